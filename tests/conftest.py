import matplotlib

# Figures are drawn and no window opens. Not by MPLBACKEND, which kernels started by tests would inherit.
matplotlib.use("Agg")
