"""The exceptions of jfpx. All derive from jfpx.Error."""


class Error(RuntimeError):
    """Base class of all exceptions that jfpx raises. The message is a sentence for the user."""


class InvalidArgument(Error, ValueError):
    """An argument is out of range, or an array has a wrong shape, type or device."""


class InvalidScene(Error, ValueError):
    """A scene cannot be simulated. The message names the body, the field, its value and the range."""


class InvalidSnapshot(Error, ValueError):
    """A snapshot is damaged, or is of another version, another precision or another program."""


class BackendUnavailable(Error):
    """A backend was requested by name and cannot be used. The message gives the reason."""


class OutOfMemory(Error, MemoryError):
    """An allocation in host or device memory failed."""


class DeviceError(Error):
    """A call of CUDA failed. The message has the call and CUDA's name of the error."""


class FileError(Error, OSError):
    """A file cannot be read or written, is truncated, or is corrupt."""


class ConcurrentUse(Error):
    """An object is used while another call on it runs, in a second thread or in a callback."""


class Closed(Error):
    """An object is used after its close()."""


for _error in (Error, InvalidArgument, InvalidScene, InvalidSnapshot, BackendUnavailable, OutOfMemory,
               DeviceError, FileError, ConcurrentUse, Closed):
    _error.__module__ = "jfpx"
