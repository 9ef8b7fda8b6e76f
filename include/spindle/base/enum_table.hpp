#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace spindle {

/// One enumerator and its word. An empty word: it is what stands where no word is given, and is
/// neither read nor written.
template <typename E>
struct EnumWord {
  std::string_view word;
  E value;
};

namespace enum_words {

/// Whether the compiler knows a name for the value: it writes a number behind a cast where it has
/// none.
template <auto value>
constexpr bool is_enumerator() {
  constexpr std::string_view self = static_cast<const char*>(__PRETTY_FUNCTION__);
  const char behind_cast = self[self.rfind(')') + 1];
  return (behind_cast < '0' || behind_cast > '9') && behind_cast != '-';
}

/// The values that an enumeration may have for its words to be checked; truth has two.
template <typename E>
inline constexpr std::size_t value_count = std::is_same_v<E, bool> ? 2 : 64;

/// Whether each enumerator below `value_count` has one row, nothing else has any, and no word
/// stands for two.
template <typename E, std::size_t count>
constexpr bool are_complete(const std::array<EnumWord<E>, count>& rows) {
  const auto rows_with = [&](const auto& is_meant) {
    std::size_t found = 0;
    for (const EnumWord<E>& row : rows) found += is_meant(row) ? 1U : 0U;
    return found;
  };
  for (const EnumWord<E>& row : rows) {
    const bool has_word = !row.word.empty();
    if (has_word && rows_with([&](const auto& r) { return r.word == row.word; }) != 1) return false;
  }
  return [&]<std::size_t... values>(std::index_sequence<values...>) {
    constexpr std::size_t enumerators =
        (std::size_t{0} + ... + (is_enumerator<static_cast<E>(values)>() ? 1U : 0U));
    const auto is_right = [&](bool is_known, E value) {
      return !is_known || rows_with([&](const auto& row) { return row.value == value; }) == 1;
    };
    return enumerators == count &&
           (is_right(is_enumerator<static_cast<E>(values)>(), static_cast<E>(values)) && ...);
  }
  (std::make_index_sequence<value_count<E>>());
}

}  // namespace enum_words

/// The words of an enumeration, spelt once: they are read and written by the same table, and errors
/// list them in its order. Made by enum_table().
template <typename E, std::size_t count>
class EnumTable {
 public:
  consteval explicit EnumTable(const std::array<EnumWord<E>, count>& rows) : rows_(rows) {
    if (!enum_words::are_complete(rows))
      throw "an enumerator has no row, or a word or row is twice";
  }

  /// The word of an enumerator; empty where it has none.
  [[nodiscard]] constexpr std::string_view text(E value) const {
    for (const EnumWord<E>& row : rows_) {
      if (row.value == value) return row.word;
    }
    return {};
  }

  /// What a word stands for; empty for a word that is none of these.
  [[nodiscard]] constexpr std::optional<E> find(std::string_view word) const {
    for (const EnumWord<E>& row : rows_) {
      if (row.word == word && !word.empty()) return row.value;
    }
    return std::nullopt;
  }

  [[nodiscard]] std::vector<std::string> words() const {
    std::vector<std::string> words;
    for (const EnumWord<E>& row : rows_) {
      if (!row.word.empty()) words.emplace_back(row.word);
    }
    return words;
  }

  /// "none, even or odd", for errors.
  [[nodiscard]] std::string alternatives() const {
    const std::vector<std::string> all = words();
    std::string text;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i != 0) text += i + 1 == all.size() ? " or " : ", ";
      text += all[i];
    }
    return text;
  }

  [[nodiscard]] constexpr auto begin() const { return rows_.begin(); }
  [[nodiscard]] constexpr auto end() const { return rows_.end(); }

 private:
  std::array<EnumWord<E>, count> rows_;
};

/// The table with these rows. Does not compile where an enumerator has none, or a row or a word is
/// there twice.
template <typename E, std::size_t count>
consteval EnumTable<E, count> enum_table(const EnumWord<E> (&rows)[count]) {
  return EnumTable<E, count>(std::to_array(rows));
}

}  // namespace spindle
