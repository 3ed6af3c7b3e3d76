/// See the header. Linked with -Bsymbolic-functions, as Ubuntu's Bullet is.
#include "tests/bullet/vtable_library.hpp"

VtableSample::~VtableSample() = default;
int VtableSample::first() const { return 1; }
int VtableSample::second() const { return 2; }

VtableSample& vtable_sample() {
  static VtableSample sample;
  return sample;
}
