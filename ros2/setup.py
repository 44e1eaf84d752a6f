"""The ament_python package; r2art itself comes from pip."""

from setuptools import setup

NAME = "r2art_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/r2art.launch.py"]),
        (f"share/{NAME}/config", ["config/r2art.yaml"]),
    ],
    install_requires=["setuptools", "r2art"],
    zip_safe=True,
    maintainer="The r2art authors",
    maintainer_email="r2art@example.com",
    description="Poses of parts and states of joints of an articulated object, from images.",
    license="Apache-2.0",
    entry_points={"console_scripts": [f"estimate = {NAME}.node:main"]},
)
