from .block import register as register
from .results import GIVEN as GIVEN
from .results import Ladder as Ladder
from .results import LadderFit as LadderFit
from .results import Registration as Registration
from .results import Residual as Residual
from .results import SonarCloud as SonarCloud
from .results import SonarPose as SonarPose
