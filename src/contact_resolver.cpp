/// The resolver of the engine: the heap picks.
#include "src/contact_resolver.hpp"

namespace jfpx::inline JFPX_ABI {

template class BasicContactResolver<IndexedHeap>;

}  // namespace jfpx::inline JFPX_ABI
