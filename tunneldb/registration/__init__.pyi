from .control import Match as Match
from .control import Motion as Motion
from .control import best_motion as best_motion
from .control import match as match
