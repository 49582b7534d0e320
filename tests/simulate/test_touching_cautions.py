"""Cautions on bodies that may touch themselves: the angle, the rows, and none where contact is modelled."""

import numpy as np

from fitting.specimens.cautions import chain_touching_cautions, models_contact, touching_cautions
from fitting.specimens.saved_models import AugmentedModel, add_effect
from pneusma_jax.effects.body import TipContact
from pneusma_jax.serial_chain.clearance import Clearance
from pneusma_jax.serial_chain.shape import ChainShape


def test_the_angle_and_the_rows_are_told():
    bend = np.array([100.0, 423.4, 300.0, np.nan])
    assert touching_cautions(bend, bend > 270.0, 270.0) == [
        "bent by up to 423 degrees in 2 of 4 rows: past 270 degrees the tip may touch the base, and contact is "
        "not modelled"
    ]
    assert touching_cautions(np.array(423.4), np.array(True), 270.0)[0].startswith("bent by 423 degrees: past 270")
    assert touching_cautions(bend, bend > 500.0, 270.0) == []


def test_a_chain_whose_segments_bend_little_each_is_told_with_its_whole_angle():
    """Three segments of 130 degrees in one plane run through each other, and none is past 270 alone."""
    bends = np.zeros((2, 3, 2))
    bends[1, :, 1] = np.deg2rad(130.0)
    overlap = Clearance(np.array([[0.04, 0.04, 0.04], [0.01, 0.01, 0.01]]), np.array([[0.05], [-0.009]]), ((0, 2),))

    class Overlapping(ChainShape):
        def clearance(self):
            return overlap

    none = np.zeros((2, 3))
    shape = Overlapping(bends, none, none, none, none, np.zeros((2, 4, 4, 4)))
    assert chain_touching_cautions(shape) == [
        "bent by up to 390 degrees in all in 1 of 2 rows, where parts of the body overlap: contact is not modelled"
    ]


def test_a_model_with_the_contact_is_not_said_to_lack_it():
    assert not models_contact(AugmentedModel(name="base"))
    assert models_contact(AugmentedModel(name="base", added=(add_effect(TipContact(stiffness=0.02), "a test"),)))
