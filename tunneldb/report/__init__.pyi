from .page import write_html as write_html
from .pdf import print_pdf as print_pdf
