from .batch import Plan as Plan
from .batch import plan as plan
from .batch import register as register
from .pool import WorkerPool as WorkerPool
from .progress import Overview as Overview
from .progress import overview as overview
