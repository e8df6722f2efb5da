"""Names of links and joints as evidence: which part of a robot their words mean, in several languages.

Names are never enough on their own: every conclusion adds joints and geometry to them.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise

from roboyard.description.model import Link

WORLD_NAMES = ("world", "map", "odom")
"""Root links of these names are the world itself."""
_WORDS: dict[str, str] = {
    "wheel": "wheel wheels roue roues rad raeder rueda ruota roda tire tyre tires whl lunzi koleso",
    "steer": "steer steering lenk direction servo knuckle swerve rudder volant",
    "caster": "caster castor casters castors castering",
    "suspension": "suspension shock shocks strut damper susp rocker bogie spring",
    "mecanum": "mecanum omni omniwheel omnidirectional swedish roller rollers holonomic planarmove",
    "rotor": "prop props propeller propellers rotor rotors blade blades helice",
    "flying": "flying uav drone quadrotor hexarotor octorotor multirotor quadcopter hexacopter multicopter "
    "mav octocopter helicopter",
    "leg": "leg legs hip thigh calf knee shin ankle foot feet toe toes hfe haa kfe femur tibia coxa tarsus "
    "shank bein fuss jambe pied pata pierna crus aak anklepitch anklebase hipyaw hiproll hippitch rleg lleg",
    "arm": "arm arms shoulder sho elbow forearm upperarm lowerarm wrist hand biceps bras epaule coude "
    "poignet hombro codo brazo schulter ellbogen handgelenk manipulator humerus clavicle sholder wrj palm "
    "rarm larm",
    "head": "head neck cervical kopf hals tete cou cabeza cuello skull eye eyes nod pantilt ptz screen",
    "pan_tilt": "pan tilt pantilt ptu",
    "trunk": "torso trunk waist chest spine lift lumbar thorax thoracic abdomen column telescopic pelvis "
    "elevator taille hueft back",
    "camera": "camera cam realsense zed kinect xtion oak stereo rgb rgbd depth optical imager astra",
    "lidar": "lidar laser range scan scanner hokuyo velodyne rplidar sick radar ouster livox",
    "finger": "finger fingers gripper jaw thumb index pinky claw fingertip tip greifer "
    "pince pinza distal proximal phalanx mcp dip pip",
    "left": "left l lf lh lr lb fl hl rl ml bl links gauche izquierda izquierdo sinistra lft lm "
    "larm lleg lhand lfoot lhip lshoulder lelbow lwrist lknee lankle lthigh lshin",
    "right": "right r rf rh rr rb fr hr br mr rechts droite derecha derecho destra rgt rm "
    "rarm rleg rhand rfoot rhip rshoulder relbow rwrist rknee rankle rthigh rshin",
    "front": "front f fl fr lf rf fore vorne vorn avant delantero forward",
    "rear": "rear back hind h rl rr hl hr lh rh bl br lb rb hinten arriere trasero aft",
    "middle": "middle mid ml mr lm rm centre center",
}
_MEANS: dict[str, tuple[str, ...]] = {}
for _part, _text in _WORDS.items():
    for _word in _text.split():
        _MEANS[_word] = (*_MEANS.get(_word, ()), _part)
_INSIDE: dict[str, tuple[str, ...]] = {
    "wheel": ("wheel", "roue_"),
    "caster": ("caster", "castor"),
    "steer": ("steer",),
    "mecanum": ("mecanum", "omni"),
    "rotor": ("propeller", "rotor"),
    "leg": ("thigh", "knee", "ankle", "foot", "calf", "shin", "leg_", "hippitch", "hiproll", "hipyaw"),
    "arm": ("shoulder", "elbow", "wrist", "forearm", "upperarm"),
    "finger": ("finger", "thumb", "proximal", "distal"),
    "head": ("head", "neck"),
    "trunk": ("torso", "waist", "chest"),
    "left": ("left",),
    "right": ("right",),
    "camera": ("camera",),
    "lidar": ("lidar", "laser", "velodyne"),
}
"""Parts whose words also count inside a longer word, as in `lefthippitch`."""


_PLACES = ("left", "right", "front", "rear", "middle")


@lru_cache(maxsize=8192)
def tokens(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case, without accents: `LFoot_2Joint` is l, foot, joint."""
    plain = "".join(c for c in unicodedata.normalize("NFKD", name) if not unicodedata.combining(c))
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", plain)
    return tuple(word.lower() for word in re.findall(r"[^\W\d_]+", spaced))


@lru_cache(maxsize=8192)
def meanings(name: str) -> frozenset[str]:
    """Return the parts that a name's words mean: wheel, leg, arm, head, left, ..."""
    words = tokens(name)
    found = {part for word in words for part in _MEANS.get(word, ())}
    for pair in pairwise(words):
        found |= {part for part in _MEANS.get("".join(pair), ()) if part not in _PLACES}
    text = name.lower()
    found |= {part for part, pieces in _INSIDE.items() if any(piece in text for piece in pieces)}
    return frozenset(found)


def count(part: str, names: Iterable[str]) -> int:
    """Return how many of some names mean a part."""
    return sum(part in meanings(name) for name in names)


def share(part: str, names: Iterable[str]) -> float:
    """Return the share of some names that mean a part; 0 without names."""
    listed = list(names)
    return count(part, listed) / len(listed) if listed else 0.0


def side(names: Iterable[str]) -> str | None:
    """Return `left` or `right` where the names say one of them more often, else None."""
    listed = list(names)
    left, right = count("left", listed), count("right", listed)
    return None if left == right else "left" if left > right else "right"


def stands_for_the_world(root: Link) -> bool:
    """Return whether a root link is named as the world is, and has no mass."""
    return root.name.lower() in WORLD_NAMES and root.inertial is None
