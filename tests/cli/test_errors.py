"""What commands say of bad input and of what they warn of."""

import warnings

from jaxsph.cli import report_errors


def test_a_warning_is_one_line_without_a_place_in_the_code(capsys):
    usual = warnings.formatwarning

    def command():
        print(warnings.formatwarning("more room:\n  again", UserWarning, "file.py", 7), end="")
        return 0

    assert report_errors("jaxsph", command) == 0
    assert capsys.readouterr().out == "jaxsph: warning: more room: again\n"
    assert warnings.formatwarning is usual


def test_bad_input_is_one_line_and_code_2(capsys):
    def command():
        raise ValueError("spacing:\n give more.")

    assert report_errors("jaxsph", command) == 2
    assert capsys.readouterr().err == "jaxsph: error: spacing: give more.\n"
