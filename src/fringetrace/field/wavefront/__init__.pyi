from .wavefronts import Wavefronts as Wavefronts, reconstruct as reconstruct
