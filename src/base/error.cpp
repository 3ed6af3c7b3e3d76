/// Destructors of the exceptions. Defining them here gives each class one vtable, and hence one
/// type identity, across shared libraries.
#include <jfpx/error.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

Error::~Error() = default;
InvalidScene::~InvalidScene() = default;
InvalidArgument::~InvalidArgument() = default;
BackendUnavailable::~BackendUnavailable() = default;
OutOfMemory::~OutOfMemory() = default;
DeviceError::~DeviceError() = default;
FileError::~FileError() = default;
InvalidSnapshot::~InvalidSnapshot() = default;

}  // namespace JFPX_ABI
}  // namespace jfpx
