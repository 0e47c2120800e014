"""What loads when it is first used."""

import importlib

import pytest


@pytest.mark.parametrize("package", ["labkit", "labkit.legged", "labkit.team"])
def test_each_name_that_a_package_offers_is_there_and_no_other(package):
    module = importlib.import_module(package)
    assert {"replay", "race", "Team"} & set(dir(module)) and not {"Any", "ModuleType", "geometry"} & set(dir(module))
    assert all(getattr(module, name) is not None for name in dir(module))
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
        _ = module.nothing
