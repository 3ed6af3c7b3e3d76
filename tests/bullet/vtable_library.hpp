/// A class of a library with a read-only vtable, which symbol lookup does not change.
#pragma once

struct [[gnu::visibility("default")]] VtableSample {
  virtual ~VtableSample();
  virtual int first() const;
  virtual int second() const;
};
[[gnu::visibility("default")]] VtableSample& vtable_sample();
