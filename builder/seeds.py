"""The hand-made seed scenes, numbered by their file names."""

from importlib.resources import files

from mpmworlds.sim.scene.scene import Scene


def load_seeds() -> dict[str, Scene]:
    """All seed scenes by name, such as `s03_snow_mixer`, in order of their numbers."""
    folder = files("mpmworlds.builder").joinpath("seeds")
    names = sorted(f.name for f in folder.iterdir() if f.name.endswith(".yaml"))
    return {
        name.removesuffix(".yaml"): Scene.from_yaml(
            folder.joinpath(name).read_text("utf-8"), name
        )
        for name in names
    }
