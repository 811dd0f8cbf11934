"""Records a demonstration, exports it three ways, and looks at each with the eyes of its readers: h5py, numpy, pickle."""

import json
import pathlib
import pickle
import sys
import tempfile
import unittest

import h5py
import numpy as np
import png
from program import flowscope, load_rlbench_demo

CAMERAS = ("front", "left_shoulder", "right_shoulder", "wrist")
SIZE = 128


class Exports(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.data = cls.folder / "data"
        # Two demonstrations: one push of a button each.
        recorded = flowscope("record", "push_buttons", "--episodes", 2, "--seed", 3, "--data", cls.data, "--json")
        cls.first, cls.second = json.loads(recorded)["demos"]
        flowscope("demos", "export", "--npz", cls.folder / "d.npz", "--data", cls.data)
        cls.npz = np.load(cls.folder / "d.npz", allow_pickle=False)
        cls.frames = len(cls.npz["demo_0/frame/time_s"])
        cls.keyframes = cls.npz["demo_0/keyframe/frame"]

    def array(self, name):
        return self.npz["demo_0/" + name]

    def test_npz(self):
        self.assertEqual(self.npz["demos"].tolist(), [2])
        header = json.loads(self.array("header").item())
        self.assertEqual((header["task"], header["frames"]), ("push_buttons", self.frames))
        moments = len(self.keyframes) + 1
        for name, shape, kind in (
            ("frame/q", (self.frames, 7), "f8"),
            ("frame/tool_quaternion", (self.frames, 4), "f8"),
            ("frame/gripper_open", (self.frames,), "u1"),
            ("observation/front_rgb", (moments, SIZE, SIZE, 3), "u1"),
            ("observation/wrist_depth", (moments, SIZE, SIZE), "f4"),
            ("observation/wrist_extrinsics", (moments, 4, 4), "f8"),
        ):
            self.assertEqual((self.array(name).shape, self.array(name).dtype.str[1:]), (shape, kind), name)
        self.assertEqual(self.array("state/qpos").shape[0], self.frames)
        # Our axes: x right, y down, z forward; pixel centres at .5. The tool itself is where its camera sees it.
        tool = self.array("frame/tool_position")[0]
        k, m = self.array("observation/front_intrinsics")[0], self.array("observation/front_extrinsics")[0]
        u, v, w = k @ (np.linalg.inv(m) @ [*tool, 1])[:3]
        self.assertTrue(0 < u / w < SIZE and 0 < v / w < SIZE)

    def test_hdf5(self):
        flowscope("demos", "export", "--hdf5", self.folder / "d.hdf5", "--data", self.data)
        with h5py.File(self.folder / "d.hdf5") as file:
            demo = self.check_robomimic(file, ["demo_0", "demo_1"])
            self.assertNotIn("front_image", demo["obs"])
            for name in ("frame/q", "observation/front_rgb", "observation/front_depth", "keyframe/position"):
                np.testing.assert_array_equal(demo["flowscope"][name], self.array(name), name)

    def test_hdf5_with_every_picture(self):
        target = self.folder / "p.hdf5"
        flowscope("demos", "export", "--hdf5", target, self.first, "--pictures", "all", "--data", self.data)
        with h5py.File(target) as file:
            demo = self.check_robomimic(file, ["demo_0"])
            samples = demo.attrs["num_samples"]
            for camera in CAMERAS:
                image, depth = demo["obs"][camera + "_image"], demo["obs"][camera + "_depth"]
                self.assertEqual((image.shape, image.dtype), ((samples, SIZE, SIZE, 3), np.uint8))
                self.assertEqual((depth.shape, depth.dtype), ((samples, SIZE, SIZE, 1), np.float32))
                for k, frame in enumerate([0, *self.keyframes[:-1]]):
                    np.testing.assert_array_equal(image[frame], self.array(f"observation/{camera}_rgb")[k])
                    np.testing.assert_array_equal(depth[frame, ..., 0], self.array(f"observation/{camera}_depth")[k])
                between = image[self.keyframes[0] - 1].astype(int) - image[self.keyframes[0]]
                self.assertLess(np.abs(between).mean(), 20, "re-drawn pictures look like their neighbours")
                self.assertGreater(image[1].std(), 5)

    def check_robomimic(self, file, names):
        """Groups, attributes and shapes as robomimic's documentation lists them; returns data/demo_0."""
        env = json.loads(file["data"].attrs["env_args"])
        self.assertEqual(env["env_name"], "push_buttons")
        self.assertIsInstance(env["env_type"], int)
        self.assertIsInstance(env["env_kwargs"], dict)
        self.assertEqual(sorted(file["data"]), names)
        self.assertEqual(file["data"].attrs["total"], sum(file["data"][n].attrs["num_samples"] for n in names))
        self.assertEqual([n.decode() for n in file["mask/train"]], ["demo_0"])
        self.assertEqual([n.decode() for n in file["mask/valid"]], names[1:])
        self.assertEqual([n.decode() for n in file["mask/push_buttons"]], names)
        for name in names:
            self.check_demo(file["data"][name])
        demo = file["data/demo_0"]
        self.assertEqual(demo.attrs["num_samples"], self.frames - 1)
        return demo

    def check_demo(self, demo):
        samples = demo.attrs["num_samples"]
        self.assertTrue(demo.attrs["model_file"].startswith("<mujoco"))
        exact = demo["flowscope"]
        width = 1 + exact["state/qpos"].shape[1] + exact["state/qvel"].shape[1]
        for name, shape, kind in (
            ("states", (samples, width), "f8"),
            ("actions", (samples, 7), "f8"),
            ("actions_abs", (samples, 7), "f8"),
            ("rewards", (samples,), "f8"),
            ("dones", (samples,), "i8"),
            ("action_dict/abs_rot_6d", (samples, 6), "f8"),
            ("action_dict/gripper", (samples, 1), "f8"),
        ):
            self.assertEqual((demo[name].shape, demo[name].dtype.str[1:]), (shape, kind), name)
        for group in ("obs", "next_obs"):
            for name, size in (("eef_pos", 3), ("eef_quat", 4), ("joint_pos", 7), ("joint_vel", 7), ("gripper_qpos", 2)):
                self.assertEqual(demo[group]["robot0_" + name].shape, (samples, size))
            self.assertEqual(demo[group]["object"].shape[0], samples)
        np.testing.assert_array_equal(demo["states"][:, 0], exact["state/time_s"][:-1])
        np.testing.assert_array_equal(demo["states"][:, 1 : 1 + exact["state/qpos"].shape[1]], exact["state/qpos"][:-1])
        np.testing.assert_array_equal(demo["obs/robot0_joint_pos"][1:], demo["next_obs/robot0_joint_pos"][:-1])
        np.testing.assert_array_equal(
            demo["obs/robot0_eef_quat"][:], np.roll(exact["frame/tool_quaternion"][:-1], -1, axis=1)
        )
        actions = demo["actions"]
        self.assertLessEqual(np.abs(actions).max(), 1)
        self.assertEqual(actions.attrs["clipped_samples"], 0)
        self.assertEqual(set(np.unique(actions[:, 6])) - {-1.0, 1.0}, set())
        reached = demo["obs/robot0_eef_pos"] + actions[:, :3] * actions.attrs["position_unit_m"]
        np.testing.assert_allclose(reached, demo["next_obs/robot0_eef_pos"], atol=1e-12)
        np.testing.assert_allclose(demo["actions_abs"][:, :3], demo["next_obs/robot0_eef_pos"], atol=1e-12)
        jumps = np.abs(np.diff(demo["actions_abs"][:, 3:6], axis=0)).max()
        self.assertLess(jumps, 0.5, "the rotation vector does not jump between its two forms")
        self.assertEqual((demo["dones"][-1], demo["dones"][:-1].sum(), demo["rewards"][-1]), (1, 0, 1))

    def test_rlbench(self):
        root = self.folder / "rlbench"
        flowscope("demos", "export", "--rlbench", root, self.first, "--data", self.data)
        episodes = root / "push_buttons" / "variation0" / "episodes"
        self.assertEqual([p.name for p in episodes.iterdir()], ["episode0"])
        episode = episodes / "episode0"
        self.assertEqual(pickle.loads((episode / "variation_number.pkl").read_bytes()), 0)
        sentences = pickle.loads((episode / "variation_descriptions.pkl").read_bytes())
        self.assertEqual(sentences, json.loads(self.array("header").item())["instructions"])
        demo = load_rlbench_demo(episode / "low_dim_obs.pkl")
        observations = demo._observations
        self.assertEqual((len(observations), demo.variation_number), (self.frames, 0))
        for camera in (*CAMERAS, "overhead"):
            for kind in ("rgb", "depth"):
                self.assertEqual(len(list((episode / f"{camera}_{kind}").iterdir())), self.frames)
        for frame in (0, int(self.keyframes[0])):
            self.check_low_dim(observations[frame], frame)
        for k, frame in enumerate([0, *map(int, self.keyframes)]):
            self.check_depth(episode, observations[frame], frame, k)
        frame = int(self.keyframes[0])
        for other in CAMERAS[1:]:
            self.check_projection(episode, observations[frame].misc, frame, "front", other)

    def check_low_dim(self, seen, frame):
        np.testing.assert_array_equal(seen.joint_positions, self.array("frame/q")[frame])
        np.testing.assert_array_equal(seen.joint_velocities, self.array("frame/dq")[frame])
        np.testing.assert_array_equal(seen.gripper_pose[:3], self.array("frame/tool_position")[frame])
        wxyz = self.array("frame/tool_quaternion")[frame]
        np.testing.assert_array_equal(seen.gripper_pose[3:], np.roll(wxyz, -1))
        self.assertEqual(seen.gripper_open, float(self.array("frame/gripper_open")[frame]))
        self.assertEqual((seen.gripper_matrix.shape, seen.gripper_joint_positions.shape), ((4, 4), (2,)))
        np.testing.assert_array_equal(seen.gripper_matrix[:3, 3], seen.gripper_pose[:3])
        self.assertEqual(int(seen.ignore_collisions), 1)
        self.assertIsNone(seen.joint_forces)

    def check_depth(self, episode, seen, frame, k):
        for camera in CAMERAS:
            rgb = png.read(episode / f"{camera}_rgb" / f"{frame}.png")
            np.testing.assert_array_equal(rgb, self.array(f"observation/{camera}_rgb")[k])
            ours = self.array(f"observation/{camera}_depth")[k]
            theirs = metres(episode, seen.misc, camera, frame)
            hit = ours > 0
            self.assertLess(np.abs(theirs - ours)[hit].max(), 1e-3)
            np.testing.assert_allclose(theirs[~hit], seen.misc[camera + "_camera_far"], rtol=1e-6)

    def check_projection(self, episode, misc, frame, camera, other):
        """The cloud by RLBench's own formula, back onto its picture and onto another camera's."""
        depth = metres(episode, misc, camera, frame)
        cloud = rlbench_cloud(depth, misc[camera + "_camera_extrinsics"], misc[camera + "_camera_intrinsics"])
        u, v, z = project(cloud, misc, camera)
        rows, columns = np.mgrid[:SIZE, :SIZE]
        self.assertLess(max(np.abs(u - columns).max(), np.abs(v - rows).max()), 1e-6)
        points = cloud[(depth < 3) & (cloud[..., 2] > 0.7)]
        u, v, z = project(points, misc, other)
        inside = (z > 0.05) & (u > 3) & (u < SIZE - 4) & (v > 3) & (v < SIZE - 4)
        u, v, z = u[inside].round().astype(int), v[inside].round().astype(int), z[inside]
        seen = metres(episode, misc, other, frame)

        in_sight = seen[v, u] > z - 0.01  # nothing stands before it
        u, v, z = u[in_sight], v[in_sight], z[in_sight]
        self.assertGreater(len(z), 300, other)
        around = np.stack([seen[v + y, u + x] for y in (-1, 0, 1) for x in (-1, 0, 1)])
        met = (np.abs(around - z).min(axis=0) < 0.01).mean()
        self.assertGreater(met, 0.96, f"{camera} seen by {other}")


def metres(episode, misc, camera, index):
    packed = png.read(episode / f"{camera}_depth" / f"{index}.png").astype(float)
    near, far = misc[camera + "_camera_near"], misc[camera + "_camera_far"]
    return near + (packed @ [65536, 256, 1]) / (2**24 - 1) * (far - near)


def rlbench_cloud(depth, extrinsics, intrinsics):
    rows, columns = np.mgrid[: depth.shape[0], : depth.shape[1]]
    pixels = np.stack([columns, rows, np.ones_like(rows)], -1) * depth[..., None]
    world_to_camera = np.linalg.inv(extrinsics)[:3]
    projection = np.vstack([intrinsics @ world_to_camera, [0, 0, 0, 1]])
    homogeneous = np.concatenate([pixels, np.ones_like(depth)[..., None]], -1)
    return (homogeneous @ np.linalg.inv(projection).T)[..., :3]


def project(points, misc, camera):
    matrix = misc[camera + "_camera_intrinsics"] @ np.linalg.inv(misc[camera + "_camera_extrinsics"])[:3]
    x, y, z = np.moveaxis(points @ matrix[:, :3].T + matrix[:, 3], -1, 0)
    return x / z, y / z, z


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
