"""One thread for the linear algebra of NumPy and SciPy; to be imported before them.

Two workers of pytest share the cores, and threads of OpenBLAS that wait for each other use the processor meanwhile: registering
a sonar scan takes twice the CPU time with two of them.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
