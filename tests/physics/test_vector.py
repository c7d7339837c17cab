"""Vectors of eight do to each number what one operation does to one."""

import math
import struct

import pytest

numba = pytest.importorskip("numba")
np = pytest.importorskip("numpy")

from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

from elib.physics.engine import engine_named, kernel  # noqa: E402
from elib.physics.vector import (  # noqa: E402
    after,
    choose,
    load,
    mask,
    pick,
    pick_two,
    real,
    root,
    size,
    spread,
    store,
    whole,
)

ENGINE = engine_named("compiled")
EIGHT = range(8)

numbers = st.floats(-1e6, 1e6) | st.sampled_from([0.0, -0.0, 1.0, math.inf, -math.inf, math.nan])
eight = st.lists(numbers, min_size=8, max_size=8)
words = st.lists(st.integers(0, 2**32 - 1), min_size=8, max_size=8)


def bits(values):
    """Return numbers so that 0.0 differs from -0.0 and every nan is equal to every other."""
    return [struct.pack("<d", float(value)) if value == value else b"nan" for value in values]


@kernel
def arithmetic(a, b, out, flags):
    x = load(a, 0)
    y = load(b, 0)
    store(out, 0, x + y)
    store(out, 8, x - y)
    store(out, 16, x * y)
    store(out, 24, x / (y * y + 1.0))
    store(out, 32, choose(x < y, x, y))
    store(out, 40, 2.0 * x - 3)
    store(out, 48, root(size(x)))
    store(out, 56, choose((x > 0.0) & (y <= 1.0) | (x == y), 7.0, spread(-1.0)))
    flags[0] = mask(x < y)
    flags[1] = mask(x >= y)
    flags[2] = mask(x != y)
    flags[3] = mask((x > 0.0) ^ (y > 0.0))


@given(eight, eight)
@settings(max_examples=60)
def test_each_number_comes_out_as_the_same_operation_on_one_gives_it(a, b):
    out, flags = ENGINE.floats([0.0] * 64), ENGINE.ints([0] * 4)
    ENGINE.bare(arithmetic)(ENGINE.floats(a), ENGINE.floats(b), out, flags)
    with np.errstate(all="ignore"):
        x, y = np.array(a), np.array(b)
        wanted = [
            *(x + y),
            *(x - y),
            *(x * y),
            *(x / (y * y + 1.0)),
            *np.where(x < y, x, y),
            *(2.0 * x - 3),
            *np.sqrt(np.abs(x)),
            *np.where((x > 0) & (y <= 1) | (x == y), 7.0, -1.0),
        ]
    assert bits(out) == bits(wanted)
    for found, is_so in zip(flags, (x < y, x >= y, x != y, (x > 0) ^ (y > 0)), strict=True):
        assert found == sum(1 << k for k in EIGHT if is_so[k])


@kernel
def scrambling(a, out, _, __):
    x = load(a, 0)
    store(out, 0, ((x ^ (x >> 16)) * 0x21F0AAAD) & 0xFFFFFFFF)
    store(out, 8, (x + 5 - load(a, 0)) | 16)
    store(out, 16, x << 3)
    store(out, 24, whole(real(x) + 0.5))


@given(words)
@settings(max_examples=40)
def test_words_are_scrambled_shifted_and_made_real_numbers_and_back(a):
    out = ENGINE.ints([0] * 32)
    ENGINE.bare(scrambling)(ENGINE.ints(a), out, 0, 0)
    assert [int(value) for value in out] == [
        *(((x ^ (x >> 16)) * 0x21F0AAAD) & 0xFFFFFFFF for x in a),
        *([5 | 16] * 8),
        *(x << 3 for x in a),
        *a,
    ]


@kernel
def picking(table, indices, out, _):
    store(out, 0, pick(table, indices, 2))
    here, following = pick_two(table, indices, 2)
    store(out, 8, here)
    store(out, 16, following)
    store(out, 24, pick(after(table, 3), indices, 2))


@given(st.lists(st.integers(0, 90), min_size=8, max_size=8))
@settings(max_examples=30)
def test_what_lies_anywhere_is_picked_together(places):
    table, out = [k * k / 7 for k in range(100)], ENGINE.floats([0.0] * 32)
    ENGINE.bare(picking)(ENGINE.floats(table), ENGINE.ints([-1, -1, *places]), out, 0)
    assert list(out) == [table[k + ahead] for ahead in (0, 0, 1, 3) for k in places]


@pytest.mark.parametrize("length", [1, 7, 26, 1000])
def test_the_engines_sequences_begin_with_a_line_of_the_cache(length):
    for array in (ENGINE.floats([1.5] * length), ENGINE.ints([3] * length)):
        assert array.ctypes.data % 64 == 0
        assert array.flags.c_contiguous
        assert len(array) == length
        assert array[0] == array[length - 1] in (1.5, 3)
