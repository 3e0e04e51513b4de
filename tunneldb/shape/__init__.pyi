from .ellipse import Ellipse as Ellipse
from .harmonics import Harmonics as Harmonics
from .harmonics import fit_harmonics as fit_harmonics
from .rings import Ring as Ring
from .rings import fit_ring as fit_ring
from .rings import fit_rings as fit_rings
