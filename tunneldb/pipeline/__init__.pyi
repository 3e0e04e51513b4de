from .load import load_files as load_files
from .load import load_kilometre as load_kilometre
from .read import read_file as read_file
