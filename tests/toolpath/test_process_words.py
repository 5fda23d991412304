import pytest

from pentapod.toolpath.process import Process, laser_power, laser_word, subject


def test_words_in_force_are_kept_in_short():
    said = ("T03", "M06", "S12000", "M3", "M7", "M08", "S8000", "M0", "M67 E0 Q0.25")
    state = Process().after(said)
    assert state.words == ("T3", "M6", "S8000", "M3", "M7", "M8", "M67 E0 Q0.25")
    assert Process().after(state.words) == state
    assert state.after(("M9", "M5", "T4")).words == ("T4", "S8000", "M5", "M9", "M67 E0 Q0.25")
    assert str(state) == "tool 3, spindle 8000 rpm, coolant M7 and M8"


def test_coolant_begins_anew_after_it_was_off():
    assert Process().after(("M7", "M9", "M8")).coolant == ("M8",)


@pytest.mark.parametrize("power", [0.0, 0.25, 1 / 3, 1.0])
def test_laser_words_give_their_power_back(power):
    assert laser_power(laser_word(power)) == pytest.approx(power, abs=5e-7)


@pytest.mark.parametrize(
    ("word", "about"),
    [("M03", "spindle"), ("S500", "spindle"), ("M9", "coolant"), ("T12", "tool"), ("M6", "tool"), ("M60", ""),
     ("M67 E0 Q1", "laser"), ("M67 E1 Q1", ""), ("M67 E0 Q2", "")],
)  # fmt: skip
def test_what_a_word_is_about(word, about):
    assert subject(word) == about
