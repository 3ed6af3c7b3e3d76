/// Explicit instantiation of the engine's resolver, BasicContactResolver<IndexedPriorityQueue>.
#include "src/world/contact_resolver.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

template class BasicContactResolver<IndexedPriorityQueue>;

}  // namespace JFPX_ABI
}  // namespace jfpx
