#pragma once

#include <fmt/core.h>

#include <compare>
#include <concepts>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "spindle/catalogue/shared.hpp"

namespace spindle::catalogue {

/// Text of the catalogue that is never changed: a literal of the program, which costs nothing to
/// have, or one that was made at run time, which all copies share. Never dangles: there is no way
/// to make one that only refers to a string of another.
class Text {
 public:
  constexpr Text() = default;
  /// Of a literal; anything that is no constant does not compile.
  // NOLINTNEXTLINE(google-explicit-constructor)
  consteval Text(const char* literal) : view_(literal) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  Text(std::string text) : made_(std::move(text)), view_(made_.get()) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  Text(std::string_view text) : Text(std::string(text)) {}

  constexpr Text(const Text&) = default;
  constexpr Text(Text&& other) noexcept
      : made_(std::move(other.made_)), view_(std::exchange(other.view_, {})) {}
  constexpr Text& operator=(Text other) noexcept {
    std::swap(made_, other.made_);
    std::swap(view_, other.view_);
    return *this;
  }
  constexpr ~Text() = default;

  [[nodiscard]] constexpr std::string_view view() const { return view_; }
  [[nodiscard]] std::string to_string() const { return std::string(view_); }
  // NOLINTNEXTLINE(google-explicit-constructor)
  constexpr operator std::string_view() const { return view_; }
  // NOLINTNEXTLINE(google-explicit-constructor)
  operator std::string() const { return to_string(); }

  [[nodiscard]] constexpr bool empty() const { return view_.empty(); }
  [[nodiscard]] constexpr std::size_t size() const { return view_.size(); }
  [[nodiscard]] constexpr std::size_t find(std::string_view part) const { return view_.find(part); }
  [[nodiscard]] constexpr bool starts_with(std::string_view head) const {
    return view_.starts_with(head);
  }

  template <std::convertible_to<std::string_view> Other>
  friend constexpr bool operator==(const Text& a, const Other& b) {
    return a.view_ == std::string_view(b);
  }
  template <std::convertible_to<std::string_view> Other>
  friend constexpr std::strong_ordering operator<=>(const Text& a, const Other& b) {
    return a.view_ <=> std::string_view(b);
  }
  friend std::string operator+(std::string a, const Text& b) { return a.append(b.view_); }
  friend std::string operator+(const Text& a, std::string_view b) {
    return a.to_string().append(b);
  }

 private:
  Shared<std::string> made_ = {};  ///< empty for a literal
  std::string_view view_ = {};
};

}  // namespace spindle::catalogue

template <>
struct fmt::formatter<spindle::catalogue::Text> : fmt::formatter<std::string_view> {
  template <typename Context>
  auto format(const spindle::catalogue::Text& text, Context& context) const {
    return fmt::formatter<std::string_view>::format(text.view(), context);
  }
};
