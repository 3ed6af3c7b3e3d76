/// Home of the exceptions' vtables, so that they have one type across shared libraries.
#include <jfpx/error.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

Error::~Error() = default;
InvalidScene::~InvalidScene() = default;
InvalidArgument::~InvalidArgument() = default;
BackendUnavailable::~BackendUnavailable() = default;
OutOfMemory::~OutOfMemory() = default;
DeviceError::~DeviceError() = default;
BuildMismatch::~BuildMismatch() = default;
FileError::~FileError() = default;

}  // namespace JFPX_ABI
}  // namespace jfpx
