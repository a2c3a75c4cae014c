from . import colour_plots as colour_plots
