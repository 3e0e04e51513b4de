from .exchange import write_survey as write_survey
from .images.image import export_kilometre as export_kilometre
from .pointcloud.single_file import classify_file as classify_file
from .pointcloud.survey import export_classified as export_classified
from .qgis.project import store_project as store_project
from .qgis.project import write_project as write_project
