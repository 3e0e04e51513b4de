import os
import sys

for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")

from .scenes import SCENES, make  # noqa: E402

if len(sys.argv) != 3 or (sys.argv[1] not in SCENES and sys.argv[1] != "all"):
    sys.exit(
        f"usage: python -m change_scenes SCENE FOLDER; SCENE one of {', '.join(SCENES)}, or all (each in a folder of its own below FOLDER)"
    )
if sys.argv[1] == "all":
    for n in SCENES:
        make(n, os.path.join(sys.argv[2], n))
else:
    make(sys.argv[1], sys.argv[2])
