from .catalog import add_survey as add_survey
from .catalog import add_tunnel as add_tunnel
from .catalog import remove_survey as remove_survey
from .catalog import remove_tunnel as remove_tunnel
from .surface import load_alignment as load_alignment
from .surface import load_surface as load_surface
from .survey import Survey as Survey
from .survey import get_survey as get_survey
