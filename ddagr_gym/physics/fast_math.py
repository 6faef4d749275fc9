"""Branch-free exp, log, sin, cos and asin that LLVM vectorises (numba ships no vector math library).

Polynomials on reduced ranges; largest errors measured in ``tests/physics/test_fast_math.py``: 1e-12 relative or
better on the stated domains.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from ddagr_gym.jit import intrinsic, kernel

LOG2_E = 1.4426950408889634  # 1/ln(2): exp(x) = 2^(x LOG2_E)
_ROUND = 6755399441055744.0  # 1.5 * 2**52: adding it leaves an integer in the low mantissa bits

# Polynomials through the Chebyshev nodes of each range; the largest errors are those of the docstrings.
_EXP2 = (
    0.6931471805599453, 0.24022650695812972, 0.05550410866476042, 0.009618129159408776, 0.0013333558179047028,
    0.00015403455846485034, 1.525268684250813e-05, 1.3255226470378598e-06, 1.0203122065960858e-07,
)  # fmt: skip
_LOG2 = (
    2.88539008177785, 0.9617966941132127, 0.5770779423594591, 0.412209256786155, 0.3199053739227617,
    0.2829066165906811,
)  # fmt: skip
_SIN = (
    0.9999999999998447, -0.16666666665671628, 0.008333333229975641, -0.00019841230561730623, 2.7550566908820958e-06,
    -2.4516186967196084e-08,
)  # fmt: skip
_COS = (
    0.9999999999999969, -0.49999999999972833, 0.04166666666279752, -0.0013888888682176315, 2.4801534692458978e-05,
    -2.755044129698534e-07, 2.0430118711924836e-09,
)  # fmt: skip
_ASIN = (
    1.0000000000000033, 0.16666666666353117, 0.07500000049834252, 0.04464282637904095, 0.03038291366140234,
    0.022354456815404197, 0.01755258911717879, 0.012535130392368678, 0.017979399736694105, -0.0074189247325715645,
    0.03159362750031693,
)  # fmt: skip


@intrinsic
def _bits(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def _from_bits(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@kernel(inline=True)
def exp2_bounded(x: float) -> float:
    """2^x for x <= 1000 within 4e-14; below -1000 it returns 2^-1000."""
    x = max(x, -1000.0)
    shifted = x + _ROUND
    r = x - (shifted - _ROUND)
    p = _EXP2[4] + r * (_EXP2[5] + r * (_EXP2[6] + r * (_EXP2[7] + r * _EXP2[8])))
    p = 1.0 + r * (_EXP2[0] + r * (_EXP2[1] + r * (_EXP2[2] + r * (_EXP2[3] + r * p))))
    return _from_bits(_bits(p) + (_bits(shifted) << 52))


@kernel(inline=True)
def log2_positive(x: float) -> float:
    """log2(x) for normal x > 0, within 3e-14 of the larger of 1 and |log2 x|."""
    bits = _bits(x)
    exponent = (bits - 0x3FE6A09E00000000) >> 52
    mantissa = _from_bits(bits - (exponent << 52))
    t = (mantissa - 1.0) / (mantissa + 1.0)
    q = t * t
    p = _LOG2[0] + q * (_LOG2[1] + q * (_LOG2[2] + q * (_LOG2[3] + q * (_LOG2[4] + q * _LOG2[5]))))
    return (_from_bits(exponent + 0x4338000000000000) - _ROUND) + t * p


@kernel(inline=True)
def inverse_sqrt(x: float) -> float:
    """1/sqrt(x) for normal x > 0 within 4e-13: a linear guess in the bits and two cubic steps."""
    y = _from_bits(0x5FE6E90000000000 - (_bits(x) >> 1))
    e = 1.0 - x * y * y
    y += y * e * (0.5007268123083732 + e * 0.37561916254229494)
    e = 1.0 - x * y * y
    return y + y * e * (0.5 + e * 0.375)


@kernel(inline=True)
def sin_small(x: float) -> float:
    """sin(x) for |x| <= 1.06 within 2e-13."""
    q = x * x
    return x * (_SIN[0] + q * (_SIN[1] + q * (_SIN[2] + q * (_SIN[3] + q * (_SIN[4] + q * _SIN[5])))))


@kernel(inline=True)
def cos_small(x: float) -> float:
    """cos(x) for |x| <= 1.06 within 1e-14."""
    q = x * x
    p = _COS[3] + q * (_COS[4] + q * (_COS[5] + q * _COS[6]))
    return _COS[0] + q * (_COS[1] + q * (_COS[2] + q * p))


@kernel(inline=True)
def asin_half(y: float) -> float:
    """asin(y) for 0 <= y <= 0.5 within 1e-14."""
    q = y * y
    p = _ASIN[5] + q * (_ASIN[6] + q * (_ASIN[7] + q * (_ASIN[8] + q * (_ASIN[9] + q * _ASIN[10]))))
    return y * (_ASIN[0] + q * (_ASIN[1] + q * (_ASIN[2] + q * (_ASIN[3] + q * (_ASIN[4] + q * p)))))
