from .design import Design as Design
from .deviation import Deviation as Deviation
from .given import GivenAxis as GivenAxis
from .given import read_given as read_given
from .landxml import LandXml as LandXml
