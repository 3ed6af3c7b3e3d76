/// The resolver of the engine, with the tournament tree as its queue.
#include "src/world/contact_resolver.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

template class BasicContactResolver<IndexedPriorityQueue>;

}  // namespace JFPX_ABI
}  // namespace jfpx
