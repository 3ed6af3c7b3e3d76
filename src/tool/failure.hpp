/// Message and exit status of an exception.
#pragma once

#include <jfpx/config.hpp>

#include <exception>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Prints an exception to stderr. One that is no std::exception is thrown again.
/// @param prefix of the message, after "jfpx: "
/// @return the exit status
int report_failure(const std::exception_ptr& failure, const std::string& prefix = {});

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
