#pragma once

#include <cstdint>
#include <optional>
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

  /// The right to serve a sink from that store, in path + ".sink-" + NAME + ".lock", where what is
  /// no letter, digit, '.', '_' or '-' stands as %XX. Error likewise.
  static Result<WriterLock> take_sink(const std::string& store, const std::string& sink);

  WriterLock(WriterLock&& other) noexcept;
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;
  WriterLock& operator=(WriterLock&&) = delete;
  ~WriterLock();

 private:
  /// Empty: another one has it, or will in a moment; `holder` is its process, where that is known.
  static Result<std::optional<WriterLock>> try_to_take(const std::string& path,
                                                       std::optional<std::uint64_t>& holder);

  explicit WriterLock(int file) : file_(file) {}

  int file_;
};

}  // namespace spindle::store
