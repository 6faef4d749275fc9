"""Reading reference tables: columns, and one sentence for each way in which a file can be wrong."""

import math
import os

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.validation.tables import read_columns, root_mean_square


def test_columns_by_name_in_any_order(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("b,soil,a\n2,sand,1\n4,clay,3e-1\n")
    numbers, texts = read_columns(path, ["a", "b"], ["soil"])
    np.testing.assert_array_equal(numbers["a"], [1.0, 0.3])
    np.testing.assert_array_equal(numbers["b"], [2.0, 4.0])
    assert texts == {"soil": ["sand", "clay"]}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "does not exist"),
        ("", "no column 'a'"),
        ("b\n1\n", "no column 'a'"),
        ("a\n", "no rows"),
        ("a\n1\nfast\n", "'fast' in row 2, column a"),
        ("x,a\n1\n", "None in row 1, column a"),
    ],
)
def test_wrong_file_is_one_sentence(tmp_path, content, words):
    path = tmp_path / "table.csv"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError) as error:
        read_columns(path, ["a"])
    assert words in str(error.value)
    assert str(path) in str(error.value)
    assert str(error.value).endswith(".")


def test_a_pipe_or_a_folder_is_no_ordinary_file(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    for path in (tmp_path / "pipe.csv", tmp_path):
        with pytest.raises(InputError, match=r"cannot be read \(it is not a regular file\): give the folder"):
            read_columns(path, ["a"])


def test_other_bytes_are_one_sentence(tmp_path):
    (tmp_path / "table.csv").write_bytes(b"a\n\xff\n")
    with pytest.raises(InputError, match="it is not UTF-8 text, at byte 2"):
        read_columns(tmp_path / "table.csv", ["a"])
    (tmp_path / "table.csv").write_text("a\n" + "1" * 200_000)
    with pytest.raises(InputError, match=r"is not a CSV file \(field larger"):
        read_columns(tmp_path / "table.csv", ["a"])


def test_root_mean_square():
    assert root_mean_square(np.array([3.0, -4.0])) == pytest.approx(math.sqrt(12.5))
    assert math.isnan(root_mean_square(np.array([])))
