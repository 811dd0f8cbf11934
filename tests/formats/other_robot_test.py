"""Exports of the second robot, which has six joints and one camera, from a task and from a scene of a user's own."""

import json
import os
import pathlib
import pickle
import tempfile
import unittest

import h5py
import numpy as np
from program import call, flowscope, load_rlbench_demo

SCENE = """<mujoco model="bench"><include file="workbench.xml"/><include file="ur5.xml"/><worldbody>
<body name="block" pos="0.25 0.2 0.772"><freejoint/><geom type="box" size="0.02 0.02 0.02"/></body></worldbody></mujoco>"""
SCRIPT = """steps:
- move: {frame: tool, position: [0.03, 0, 0.04], rpy_deg: [0, 0, 0], path: linear}
- gripper: close
"""


class OtherRobot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.data = cls.folder / "data"
        (cls.folder / "bench.xml").write_text(SCENE)
        (cls.folder / "script.yaml").write_text(SCRIPT)
        task = flowscope("record", "put_fruit_in_bowl", "--seed", 1, "--data", cls.data, "--json")
        scene = flowscope("record", "--scene", cls.folder / "bench.xml", "--robot", "ur5", "--script",
                          cls.folder / "script.yaml", "--instruction", "wave", "--data", cls.data, "--json")
        cls.ids = [json.loads(report)["demos"][0] for report in (task, scene)]
        cls.frames = [json.loads(flowscope("demos", "show", i, "--data", cls.data, "--json"))["frames"] for i in cls.ids]

    def export(self, *words):
        flowscope("demos", "export", *words, *self.ids, "--data", self.data)

    def check_import(self, form, source):
        back = self.folder / ("back" + form)
        for imported, known in ((2, 0), (0, 2)):  # a second time all is there already
            report = json.loads(flowscope("demos", "import", form, source, "--data", back, "--json"))
            self.assertEqual((len(report["imported"]), report["known"]), (imported, known))
        contents = [sorted(p.read_bytes() for p in (d / "demos").glob("*.demo")) for d in (self.data, back)]
        self.assertEqual(*contents)

    def test_npz(self):
        self.export("--npz", self.folder / "d.npz")
        npz = np.load(self.folder / "d.npz", allow_pickle=False)
        for i, frames in enumerate(self.frames):
            header = json.loads(npz[f"demo_{i}/header"].item())
            self.assertEqual(header["robot"], {"name": "ur5", "joints": 6})
            self.assertEqual("scene" in header, i == 1)
            for name in ("frame/q", "frame/dq"):
                self.assertEqual(npz[f"demo_{i}/{name}"].shape, (frames, 6))
        self.assertEqual(header["scene"]["file"], str(self.folder / "bench.xml"))
        self.check_import("--npz", self.folder / "d.npz")

    def test_hdf5(self):
        self.export("--hdf5", self.folder / "d.hdf5", "--pictures", "all")
        with h5py.File(self.folder / "d.hdf5") as file:
            kwargs = json.loads(file["data"].attrs["env_args"])["env_kwargs"]
            self.assertEqual(kwargs["robots"], ["ur5"])
            self.assertEqual(kwargs["camera_names"][0], "front")
            for i, frames in enumerate(self.frames):
                demo = file[f"data/demo_{i}"]
                samples = frames - 1
                self.assertEqual(demo["actions"].shape, (samples, 7), "a tool's step, whatever arm carries it")
                for group in ("obs", "next_obs"):
                    for name, size in (("joint_pos", 6), ("joint_vel", 6), ("gripper_qpos", 2), ("eef_quat", 4)):
                        self.assertEqual(demo[group]["robot0_" + name].shape, (samples, size))
                self.assertEqual(demo["obs/front_image"].shape[0], samples)
                np.testing.assert_array_equal(demo["obs/robot0_joint_pos"], demo["flowscope/frame/q"][:-1])
                self.assertTrue(demo.attrs["model_file"].startswith("<mujoco"))
                finger = demo["obs/robot0_gripper_qpos"][0]
                self.assertAlmostEqual(finger[0], 0.674, delta=0.02, msg="a hinge: radians, open")
        self.check_import("--hdf5", self.folder / "d.hdf5")

    def test_rlbench(self):
        root = self.folder / "rlbench"
        self.export("--rlbench", root)
        for task, frames, cameras in (
            ("put_fruit_in_bowl", self.frames[0], {"front", "overhead"}),
            ("bench", self.frames[1], None),
        ):
            episode = root / task / "variation0" / "episodes" / "episode0"
            seen = load_rlbench_demo(episode / "low_dim_obs.pkl")._observations
            self.assertEqual(len(seen), frames)
            for observation in (seen[0], seen[-1]):
                self.assertEqual((observation.joint_positions.shape, observation.joint_velocities.shape), ((6,), (6,)))
                self.assertEqual((observation.gripper_pose.shape, observation.gripper_joint_positions.shape), ((7,), (2,)))
            found = {p.name.removesuffix("_rgb") for p in episode.glob("*_rgb")}
            self.assertIn("overhead", found)
            self.assertEqual(found, cameras or found)
            for camera in found:
                self.assertIn(camera + "_camera_intrinsics", seen[0].misc)
                self.assertEqual(len(list((episode / f"{camera}_depth").iterdir())), frames)
        sentences = pickle.loads((root / "bench/variation0/variation_descriptions.pkl").read_bytes())
        self.assertEqual(sentences, ["wave"])
        self.check_import("--rlbench", root)

    def test_arms_of_two_kinds_do_not_share_an_hdf5_file(self):
        data = self.folder / "mixed"
        flowscope("demos", "merge", self.data, "--data", data)
        flowscope("record", "push_buttons", "--seed", 3, "--data", data)
        done = call("demos", "export", "--hdf5", self.folder / "mixed.hdf5", "--data", data)
        self.assertEqual(done.returncode, 2)
        self.assertIn("joints", done.stderr)
        self.assertFalse(os.path.exists(self.folder / "mixed.hdf5"))
        flowscope("demos", "export", "--npz", self.folder / "mixed.npz", "--data", data)


if __name__ == "__main__":
    unittest.main(argv=["other_robot_test", "-v"])
