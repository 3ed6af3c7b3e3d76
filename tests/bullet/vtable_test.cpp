/// Test of the replacement of virtual functions in libraries.
#include "src/bullet/preload/vtable.hpp"

#include "tests/bullet/vtable_library.hpp"

#include <gtest/gtest.h>

namespace {

int replacement(const VtableSample*) { return 7; }

TEST(Vtable, ReplacesAFunctionThatSymbolLookupDoesNot) {
  void* const vtable = dlsym(RTLD_DEFAULT, "_ZTV12VtableSample");
  void* const original = dlsym(RTLD_DEFAULT, "_ZNK12VtableSample6secondEv");
  void* const own = reinterpret_cast<void*>(replacement);
  ASSERT_NE(vtable, nullptr);
  ASSERT_NE(original, nullptr);
  EXPECT_EQ(vtable_sample().second(), 2);
  EXPECT_TRUE(jfpx::preload::replace_in_vtable(vtable, original, own));
  EXPECT_EQ(vtable_sample().first(), 1);
  EXPECT_EQ(vtable_sample().second(), 7);
  EXPECT_TRUE(jfpx::preload::replace_in_vtable(vtable, original, nullptr)) << "it is gone";
  EXPECT_EQ(vtable_sample().second(), 7);
  EXPECT_TRUE(jfpx::preload::replace_in_vtable(vtable, own, original));
  EXPECT_EQ(vtable_sample().second(), 2);
  EXPECT_TRUE(jfpx::preload::replace_in_vtable(nullptr, original, own));
  EXPECT_TRUE(jfpx::preload::replace_in_vtable(vtable, nullptr, own));
  EXPECT_EQ(vtable_sample().second(), 2);
}

}  // namespace
