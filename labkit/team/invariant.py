"""Poses turned about the origin, and a filter whose covariance is that of such turns."""

import numpy as np
from scipy.linalg import block_diag

from ..geometry import Array, Covariance, Poses, wrap


def turned_about_origin(x: Poses, xi: Array) -> Poses:
    """Poses (n, 3) after the shifts and turns about the origin xi (n, 3) [m, m, rad]: Exp(xi) x."""
    t = np.where(np.abs(xi[:, 2]) < 1e-8, 1e-8, xi[:, 2])
    c, s = np.cos(t), np.sin(t)
    a, b = s / t, (1 - c) / t
    px = c * x[:, 0] - s * x[:, 1] + a * xi[:, 0] - b * xi[:, 1]
    py = s * x[:, 0] + c * x[:, 1] + b * xi[:, 0] + a * xi[:, 1]
    return np.column_stack([px, py, wrap(x[:, 2] + xi[:, 2])])


class Turning:
    """The part of a filter for poses x (n, 3) that keeps P_xi (3n, 3n), the covariance of xi, in place of P."""

    x: Poses
    P_xi: Covariance

    def frame(self) -> Array:
        """T (3n, 3n) at the present estimate: what xi does to the poses, to first order."""
        return block_diag(*([[1, 0, -y], [0, 1, x], [0, 0, 1]] for x, y, _ in self.x))

    @property
    def P(self) -> Covariance:
        """The covariance (3n, 3n) of the poses; setting it sets P_xi."""
        T = self.frame()
        return T @ self.P_xi @ T.T

    @P.setter
    def P(self, P: Covariance) -> None:
        """Keep the covariance P (3n, 3n) as P_xi."""
        back = np.linalg.inv(self.frame())
        self.P_xi = back @ P @ back.T
