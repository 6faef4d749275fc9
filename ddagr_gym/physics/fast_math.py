"""Branch-free exp, log, sin, cos and asin that LLVM vectorises (numba ships no vector math library).

Polynomials on reduced ranges; largest errors measured in ``tests/physics/test_fast_math.py``: 1e-11 relative or
better on the stated domains.
"""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from ddagr_gym.jit import kernel

_MAGIC = 6755399441055744.0  # 1.5 * 2**52: adding it leaves an integer in the low mantissa bits
_LOG2_E = 1.4426950408889634
_LN2_HIGH = 6.93147180369123816490e-01
_LN2_LOW = 1.90821492927058770002e-10
_LN2 = 0.6931471805599453


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
def exp_negative(x: float) -> float:
    """exp(x) for x <= 700; below -700 it returns exp(-700)."""
    x = max(x, -700.0)
    k = math.floor(x * _LOG2_E + 0.5)
    r = (x - k * _LN2_HIGH) - k * _LN2_LOW
    p = 1 / 720 + r * (1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800)))))
    p = 1.0 + r * (1.0 + r * (0.5 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * p)))))
    return p * _from_bits((_bits(k + _MAGIC) << 52) + 0x3FF0000000000000)


@kernel(inline=True)
def log_positive(x: float) -> float:
    """log(x) for normal x > 0."""
    bits = _bits(x)
    exponent = (bits - 0x3FE6A09E00000000) >> 52
    mantissa = _from_bits(bits - (exponent << 52))
    t = (mantissa - 1.0) / (mantissa + 1.0)
    q = t * t
    series = 1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * (1 / 11 + q * (1 / 13 + q * (1 / 15))))))
    return (_from_bits(exponent + 0x4338000000000000) - _MAGIC) * _LN2 + 2 * t * (1 + q * series)


@kernel(inline=True)
def sin_small(x: float) -> float:
    """sin(x) for |x| <= 1.6."""
    q = x * x
    p = 1 / 362880 - q * (1 / 39916800 - q * (1 / 6227020800 - q * (1 / 1307674368000)))
    return x * (1 - q * (1 / 6 - q * (1 / 120 - q * (1 / 5040 - q * p))))


@kernel(inline=True)
def cos_small(x: float) -> float:
    """cos(x) for |x| <= 1.6."""
    q = x * x
    p = 1 / 3628800 - q * (1 / 479001600 - q * (1 / 87178291200 - q * (1 / 20922789888000)))
    return 1 - q * (0.5 - q * (1 / 24 - q * (1 / 720 - q * (1 / 40320 - q * p))))


_ASIN = tuple(math.comb(2 * k, k) / (4**k * (2 * k + 1)) for k in range(20))


@kernel(inline=True)
def asin_half(y: float) -> float:
    """asin(y) for 0 <= y <= 0.5 (its Maclaurin series to y^39)."""
    q = y * y
    p = _ASIN[15] + q * (_ASIN[16] + q * (_ASIN[17] + q * (_ASIN[18] + q * _ASIN[19])))
    p = _ASIN[10] + q * (_ASIN[11] + q * (_ASIN[12] + q * (_ASIN[13] + q * (_ASIN[14] + q * p))))
    p = _ASIN[5] + q * (_ASIN[6] + q * (_ASIN[7] + q * (_ASIN[8] + q * (_ASIN[9] + q * p))))
    p = _ASIN[1] + q * (_ASIN[2] + q * (_ASIN[3] + q * (_ASIN[4] + q * p)))
    return y * (1 + q * p)
