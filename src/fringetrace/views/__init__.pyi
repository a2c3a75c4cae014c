from .plots import colour_plots as colour_plots
from .plots.brdf import (
    brdf as brdf,
    mirror_spectra as mirror_spectra,
    overview as overview,
    polar as polar,
    spectrogram as spectrogram,
)
from .plots.images import (
    height as height,
    interferogram as interferogram,
    phase as phase,
    residual as residual,
    save as save,
    side_by_side as side_by_side,
)
from .plots.spectra import comparison as comparison, spectra as spectra, work_precision as work_precision
from .scene3d import viewer as viewer
from .scene3d.describe import describe_path as describe_path
from .scene3d.subprocess import opengl as opengl
from .scene3d.viewer import export as export, few as few, page as page, picture as picture, show as show
