"""The C functions that ``casadi.external`` finds in a compiled model, including derivatives.

CasADi looks for ``jac_f``, ``adj1_f`` and ``jac_adj1_f`` beside ``f``. It differentiates by the
four numbers of the quaternion, the C functions by a rotation of the torso: turn = T d(quaternion),
T (3, 4) = 2 vec(conj(q) .) / |q|^2.
"""
