from .correction import Observations as Observations
from .oren_nayar import incidence_db as incidence_db
from .range_curve import RangeCurve as RangeCurve
from .range_curve import estimate_range_curve as estimate_range_curve
from .reference_curve import ReferenceCurve as ReferenceCurve
from .roughness import Roughness as Roughness
from .roughness import find_roughness as find_roughness
