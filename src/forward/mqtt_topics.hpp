#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace spindle::forward {

/// A name as one level of a topic: what no level may have, or what would look like something else,
/// stands as %XX, byte by byte: '+', '#', '/', '%', '$', blanks, control characters, a '_' in front
/// (levels that begin so are ours), and what is no UTF-8. An empty name is "%". A long one keeps
/// its beginning, and behind "%~" a number made of all of it. Two names never become one.
std::string level_of(std::string_view name);

/// The topics below a base.
class Topics {
 public:
  explicit Topics(std::string base) : base_(std::move(base)) {}

  [[nodiscard]] std::string of_tool(std::string_view target, std::string_view what) const;
  [[nodiscard]] std::string of_collector(std::string_view name) const;

 private:
  std::string base_;
};

}  // namespace spindle::forward
