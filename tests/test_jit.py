"""What the package's kernels promise: arrays on the stack, the same bits wherever inlined."""

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numba.core.errors import NumbaError

from ddagr_gym import jit
from ddagr_gym.jit import borrowed, claim, count_of, count_up, kernel, stack_array


@kernel(cached=False)
def fill_two(values, sums):
    first, second = stack_array(8), stack_array(8)
    for i in range(8):
        first[i] = values[i]
        second[i] = -values[i]
    for i in range(8):
        first[i] += 1.0
    for i in range(8):
        sums[i] = first[i] + second[i]


@kernel(cached=False)
def depth(level, result):
    mine = stack_array(4)
    for i in range(4):
        mine[i] = level + i
    if level < 5:
        depth(level + 1, result)
    for i in range(4):
        result[level, i] = mine[i]


def test_stack_arrays_do_not_overlap():
    sums = np.zeros(8)
    fill_two(np.arange(8.0), sums)
    np.testing.assert_array_equal(sums, 1.0)


def test_every_call_has_its_own_stack_array():
    result = np.zeros((6, 4))
    depth(0, result)
    np.testing.assert_array_equal(result, np.add.outer(np.arange(6), np.arange(4)))


@kernel(cached=False)
def first_of_depth(level, result):
    depth(level, result)
    return result[level, 0]


def test_a_kernel_that_calls_itself_may_be_called_by_another_first():
    assert first_of_depth(0, np.zeros((6, 4))) == 0.0
    assert first_of_depth(3, np.zeros((6, 4))) == 3.0


def test_what_kernels_call_is_compiled_without_code_for_python():
    @kernel(cached=False)
    def half(x):
        return 0.5 * x

    @kernel(cached=False)
    def quarter(x):
        return half(half(x))

    assert quarter(4.0) == 1.0
    assert not half.overloads
    assert half(4.0) == 2.0
    assert len(half.overloads) == 1
    for dispatcher, whether in ((half, True), (half._twin, False)):
        (compiled,), (code,) = dispatcher.overloads.values(), dispatcher.inspect_llvm().values()
        assert compiled.fndesc.mangled_name in code
        assert (compiled.fndesc.llvm_cpython_wrapper_name in code) is whether
        assert (compiled.fndesc.llvm_cfunc_wrapper_name in code) is whether


def test_a_kernel_is_made_again_where_it_is_unpickled():
    again = type(first_of_depth)._rebuild(**first_of_depth._reduce_states() | {"uuid": "of another process"})
    assert again is not first_of_depth
    assert again(2, np.zeros((6, 4))) == 2.0


def test_stack_array_needs_a_constant_size():
    @kernel(cached=False)
    def variable(size):
        return stack_array(size)[0]

    with pytest.raises(NumbaError):
        variable(3)


@kernel(cached=False)
def claim_all(claims, turn, mine):
    for i in range(claims.size):
        mine[i] = claim(claims, i, turn)


def test_each_index_is_claimed_by_one_of_several_threads():
    claims, mine = np.zeros(200_000, dtype=np.int64), np.zeros((4, 200_000), dtype=bool)
    claim_all(claims[:0], 1, mine[0, :0])  # compiled before the threads start
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(claim_all, [claims] * 4, [3] * 4, mine))
    assert (mine.sum(axis=0) == 1).all()
    assert (claims == 3).all()


def test_a_turn_that_has_been_claims_nothing():
    claims, mine = np.array([4, 5, 6]), np.zeros(3, dtype=bool)
    claim_all(claims, 5, mine)
    assert mine.tolist() == [True, False, False]
    assert claims.tolist() == [5, 5, 6]


def test_claims_must_be_whole_numbers():
    with pytest.raises(NumbaError):
        claim_all(np.zeros(3), 1, np.zeros(3, dtype=bool))


@kernel(cached=False)
def count_many(counts, many):
    for _ in range(many):
        count_up(counts)
    return count_of(counts)


def test_threads_count_without_losing_any():
    counts = np.zeros(1, dtype=np.int64)
    count_many(counts, 0)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(count_many, [counts] * 4, [100_000] * 4))
    assert counts[0] == max(found) == 400_000


def test_counts_must_be_whole_numbers():
    with pytest.raises(NumbaError):
        count_many(np.zeros(1), 1)


@kernel(cached=False)
def write_borrowed(value, bundle):
    value, bundle = borrowed(value), borrowed(bundle)
    value[1:][0] = bundle[1][0][2] * bundle[0]
    return value.size


def test_borrowed_arrays_are_the_same_ones_and_outlive_it():
    value, inner = np.zeros(3), np.arange(3.0)
    users = sys.getrefcount(value)
    for _ in range(10):
        assert write_borrowed(value, (5, (inner, inner))) == 3
    assert value.tolist() == [0.0, 10.0, 0.0]
    assert sys.getrefcount(value) == users


def test_unfused_function_gives_plain_arithmetic():
    @kernel(cached=False, inline=True, fused=False)
    def apart(a, b, c):
        return a * b + c

    @kernel(cached=False)
    def around(a, b, c):
        return apart(a, b, c)

    a, b = 1.0 + 2.0**-30, 1.0 - 2.0**-30
    assert around(a, b, -1.0) == a * b - 1.0


def test_code_of_other_sources_or_signatures_is_never_taken(tmp_path):
    """numba's index would name the file of the old code before the new one is there."""
    old, new = (jit._CacheFile(str(tmp_path), "kernel-1.py311", stamp) for stamp in ("old", "new"))
    old.save(("float64",), "old code")
    assert new.load(("float64",)) is None
    new.save(("float64",), "new code")
    new.save(("int64",), "of integers")
    assert [new.load((kind,)) for kind in ("float64", "int64", "bool")] == ["new code", "of integers", None]
    assert old.load(("float64",)) == "old code"


def test_every_cached_kernel_keeps_its_code_apart():
    from ddagr_gym.simulator_kernel import advance_rows

    files = [dispatcher._cache._cache_file for dispatcher in (advance_rows, advance_rows._twin)]
    assert all(isinstance(file, jit._CacheFile) for file in files)
    assert len({file._name(("float64",)) for file in files}) == 2
