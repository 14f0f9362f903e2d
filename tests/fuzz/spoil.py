"""HDF5 files with something wrong in them: numbers, shapes, types, names, attributes, links."""

import random

import h5py
import numpy as np

ODD = (np.nan, np.inf, -np.inf, -1.0, 0.0, 1e300, -1e300, 1e-300, 2.0**53 + 2, 0.5, 4294967296.0)
ATTRIBUTES = (
    *(np.nan, np.inf, -1.0, 0, 2, 2**40, 1e300, "", "x", "two\nlines", b"\xff", True),
    *(np.array([1.0, 2.0]), np.array([]), np.array(["a", "b"], dtype="S1"), np.array([[1.0]])),
)


def spoil(data: bytes, rng: random.Random) -> bytes:
    """A file's bytes, one to three of its objects spoilt."""
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
    access.set_fapl_core(1 << 14, False)
    access.set_file_image(data)
    opened = h5py.h5f.open(b"spoilt", h5py.h5f.ACC_RDWR, access)
    with np.errstate(all="ignore"), h5py.File(opened) as file:
        for _ in range(rng.choice((1, 1, 2, 3))):
            names = ["/"]
            file.visit(names.append)
            name = rng.choice(names)
            if name == "/" or rng.random() < 0.25:
                attribute(file[name], rng)
            elif rng.random() < 0.15:
                astray(file, name, rng)
            elif isinstance(file[name], h5py.Dataset) and (file[name].size or 0) < 1000:
                dataset(file, name, rng)
        file.flush()
        return opened.get_file_image()


def attributes(thing: h5py.HLObject) -> dict:
    """What a thing's attributes hold, text that is no UTF-8 as its bytes."""
    return {
        name: one.encode("utf-8", "surrogateescape") if isinstance(one, str) else one
        for name, one in thing.attrs.items()
    }


def attribute(thing: h5py.HLObject, rng: random.Random):
    names = list(thing.attrs)
    name = rng.choice(names) if names else "shape"
    if rng.random() < 0.3 and name in thing.attrs:
        del thing.attrs[name]
    else:
        thing.attrs[name] = rng.choice(ATTRIBUTES)


def astray(file: h5py.File, name: str, rng: random.Random):
    """Something else under a name, or nothing."""
    told = attributes(file[name])
    del file[name]
    how = rng.randrange(6)
    if how == 0:
        file[name] = h5py.SoftLink("/nowhere")
    elif how == 1:
        file[name] = h5py.SoftLink("/")
    elif how == 2:
        file[name] = h5py.ExternalLink("elsewhere.h5", "/")
    elif how == 3:
        file.create_group(name).attrs.update({"value": 0.5, "shape": rng.choice((2, 2**50, -1))})
    elif how == 4:
        file.create_dataset(name, (2**40,), "f8", chunks=(16,)).attrs.update(told)


def dataset(file: h5py.File, name: str, rng: random.Random):
    old = file[name][()]
    told = attributes(file[name])
    how = rng.randrange(8)
    new: object = old
    if np.asarray(old).dtype.kind not in "iufb":
        how = 3 + how % 4
    if how < 3 and np.size(old) and np.asarray(old).dtype.kind in "iuf":
        flat = np.array(old, dtype=float).ravel()
        flat[rng.randrange(flat.size)] = rng.choice(ODD)
        if np.asarray(old).dtype.kind == "f":
            file[name][...] = flat.reshape(np.shape(old))
            return
        new = flat.reshape(np.shape(old))
    elif how == 3:
        new = np.ravel(old)[: rng.randrange(3)]
    elif how == 4:
        new = np.stack([old, old])
    elif how == 5:
        new = np.ravel(old)[0] if np.size(old) else 1.0
    elif how == 6:
        new = rng.choice((b"a word", "text", h5py.Empty("f8"), np.array([b"a", b"b"])))
    else:
        kinds = ("i1", "u2", "f2", ">f4", "c16", "?")
        new = np.nan_to_num(np.asarray(old, dtype=float)).astype(rng.choice(kinds))
    if np.asarray(new).dtype.kind == "O" and not isinstance(new, h5py.Empty):
        new = "text"  # what was text already
    del file[name]
    file[name] = new
    file[name].attrs.update(told)
