#pragma once

#include <string>

#include "spindle/base/error.hpp"

namespace spindle::store {

/// The right to write a store, as long as it lives. The system ends it with the program, however
/// that ends; the file stays.
class WriterLock {
 public:
  /// Takes it for the store of this path, in path + ".lock". Error `storage` where another one has
  /// it: the message names its process.
  static Result<WriterLock> take(const std::string& store);

  WriterLock(WriterLock&& other) noexcept;
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;
  WriterLock& operator=(WriterLock&&) = delete;
  ~WriterLock();

 private:
  explicit WriterLock(int file) : file_(file) {}

  int file_;
};

}  // namespace spindle::store
