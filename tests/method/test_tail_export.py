import onnxruntime
import pytest
import torch

from r2art.method import depth, rotation, se3
from r2art.method.kinematics import forward_kinematics, joints_in_camera
from r2art.method.shape import Deformation, Prior, deform


class Tail(torch.nn.Module):
    """From the network's numbers to poses, boxes and joints, as the exported model has it."""

    def __init__(self, prior: Prior):
        super().__init__()
        self.prior = prior

    def forward(self, up, right, phi, log_lambda, joint_state, log_scale, shift, box, K):
        ray = depth.viewing_ray(box, K)
        R = rotation.rotation_from_directions(up, right)
        R = rotation.allocentric_to_egocentric(R, ray)
        t = depth.root_translation(phi, log_lambda, box, K, self.prior.frontal_area)
        shape = deform(self.prior, Deformation(log_scale=log_scale, center_shift=shift))
        cam_T_root = se3.from_rotation_translation(R, t)
        root_T_part = forward_kinematics(shape.kinematics, joint_state)
        cam_T_part = cam_T_root[..., None, :, :] @ root_T_part
        joints = joints_in_camera(cam_T_part, shape.kinematics)
        return cam_T_part, shape.box_center, shape.box_size, *joints


@pytest.mark.filterwarnings("ignore")
def test_onnx_runtime_computes_what_torch_does(chest, tmp_path):
    tail = Tail(Prior.from_category(chest)).eval()
    K = torch.tensor([[[60.0, 0.0, 24.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]]])
    box = torch.tensor([[10.0, 12.0, 30.0, 40.0]])

    def numbers():
        parts = [torch.randn(1, 3), torch.randn(1, 3), torch.randn(1, 2), torch.randn(1)]
        return (*parts, torch.rand(1, 3), *(0.1 * torch.randn(2, 1, 4, 3)), box, K)

    path = tmp_path / "tail.onnx"
    torch.onnx.export(tail, numbers(), path, dynamo=True, verbose=False)
    session = onnxruntime.InferenceSession(path)
    names = [i.name for i in session.get_inputs()]
    for _ in range(5):
        inputs = numbers()
        feed = {name: x.numpy() for name, x in zip(names, inputs, strict=True)}
        for actual, expected in zip(session.run(None, feed), tail(*inputs), strict=True):
            torch.testing.assert_close(torch.as_tensor(actual), expected, atol=1e-5, rtol=1e-5)
