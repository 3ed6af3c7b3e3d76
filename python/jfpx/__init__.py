"""Contacts among spheres and worlds of rigid bodies, with equal results on CPU and GPU.

find_contacts(), find_pairs() and SphereCollider search arrays of spheres or points. World makes the
steps of a Scene. All results are the same to the last bit on every backend and for every number of
threads. Units of worlds are SI; vectors are (x, y, z), and quaternions (w, x, y, z). All exceptions
of the package derive from jfpx.Error.
"""

from ._character import CharacterHit, CharacterMove, CharacterSettings, CharacterState
from ._collider import (ContactRows, Contacts, PeriodicContactRows, PeriodicContacts, PeriodicPairs,
                        PeriodicRows, Rows, SphereCollider, available_backends, available_gpus,
                        find_contacts, find_pairs)
from ._contact_generators import ContactContext, DetectedContacts
from ._errors import (BackendUnavailable, Closed, ConcurrentUse, DeviceError, Error, FileError,
                      InvalidArgument, InvalidScene, InvalidSnapshot, OutOfMemory)
from ._forces import (Attachment, BodyId, BodyState, Bungee, Buoyancy, Drag, Explosion,
                      ForceContext, Gravity, Spring, States, interpolate)
from ._joints import (BallJoint, DistanceJoint, FixedJoint, HingeJoint, Joint, JointId, JointState,
                      SliderJoint, WheelJoint, place_joint)
from ._nearest import Nearest, PeriodicNearest, find_nearest
from ._neighbors import Neighbors, find_neighbors
from ._recording import Recording, RecordingWriter, TrajectoryWriter
from ._scene import Scene, centred, scene_names
from ._view import View
from ._world import (BEGIN, END, STAY, BodyDistance, BodyDistances, ContactEvents, ContactForces,
                     DebugLines, HitEvents, RayHit, RayHits, ShapeHit, ShapeHits, StepReport, World,
                     WorldContacts)

__version__ = "0.3.0"

__all__ = [
    "Attachment", "BEGIN", "BackendUnavailable", "BallJoint", "BodyDistance", "BodyDistances", "BodyId",
    "BodyState", "Bungee", "Buoyancy", "CharacterHit", "CharacterMove", "CharacterSettings", "CharacterState",
    "Closed", "ConcurrentUse", "ContactContext", "ContactEvents", "ContactForces", "ContactRows", "Contacts", "DebugLines",
    "DetectedContacts", "DeviceError", "DistanceJoint", "Drag", "END", "Error", "Explosion", "FileError", "FixedJoint", "ForceContext", "Gravity",
    "HingeJoint", "HitEvents", "InvalidArgument", "InvalidScene", "InvalidSnapshot", "Joint", "JointId", "JointState",
    "Nearest", "Neighbors", "OutOfMemory", "PeriodicContactRows", "PeriodicContacts", "PeriodicNearest",
    "PeriodicPairs", "PeriodicRows", "RayHit", "RayHits", "Recording", "RecordingWriter", "Rows", "STAY",
    "Scene", "ShapeHit", "ShapeHits", "SliderJoint", "SphereCollider", "Spring", "States", "StepReport",
    "TrajectoryWriter", "View", "WheelJoint", "World", "WorldContacts", "available_backends", "available_gpus",
    "centred", "find_contacts", "find_nearest", "find_neighbors", "find_pairs", "interpolate", "place_joint", "scene_names",
]
