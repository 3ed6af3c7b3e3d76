/// The resolver of the engine: a tournament picks.
#include "src/contact_resolver.hpp"

namespace jfpx::inline JFPX_ABI {

template class BasicContactResolver<Tournament>;

}  // namespace jfpx::inline JFPX_ABI
