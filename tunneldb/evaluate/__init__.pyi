from .measure import Comparison as Comparison
from .measure import Figures as Figures
from .measure import compare as compare
from .measure import figures as figures
from .survey import read_findings as read_findings
from .truth import Truth as Truth
from .truth import read_truth as read_truth
