#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "spindle/catalogue/shared.hpp"

namespace spindle::catalogue {

/// A sequence of the catalogue that is never changed: a constant array of the program, which costs
/// nothing to have, or one that was made at run time, which all copies share. Never dangles.
template <typename T>
class List {
 public:
  using value_type = T;
  using const_iterator = const T*;

  constexpr List() = default;
  /// Of a constant array of the program; anything else does not compile.
  template <std::size_t size>
  // NOLINTNEXTLINE(google-explicit-constructor, modernize-avoid-c-arrays)
  consteval List(const T (&table)[size]) : first_(table), size_(size) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  List(std::vector<T> items)
      : made_(std::move(items)), first_(made_.get().data()), size_(made_.get().size()) {}
  List(std::initializer_list<T> items) : List(std::vector<T>(items)) {}

  constexpr List(const List&) = default;
  constexpr List(List&& other) noexcept
      : made_(std::move(other.made_)),
        first_(std::exchange(other.first_, nullptr)),
        size_(std::exchange(other.size_, 0)) {}
  constexpr List& operator=(List other) noexcept {
    std::swap(made_, other.made_);
    std::swap(first_, other.first_);
    std::swap(size_, other.size_);
    return *this;
  }
  constexpr ~List() = default;

  [[nodiscard]] constexpr const T* begin() const { return first_; }
  [[nodiscard]] constexpr const T* end() const { return first_ + size_; }
  [[nodiscard]] constexpr const T* data() const { return first_; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr const T& operator[](std::size_t at) const { return first_[at]; }
  [[nodiscard]] constexpr const T& front() const { return first_[0]; }
  [[nodiscard]] constexpr const T& back() const { return first_[size_ - 1]; }

 private:
  Shared<std::vector<T>> made_ = {};  ///< empty for an array of the program
  const T* first_ = nullptr;
  std::size_t size_ = 0;
};

/// One line of a table.
template <typename Key, typename Value>
struct Entry {
  Key key;
  Value value;
};

/// A list of entries by ascending key, each key once.
template <typename Key, typename Value>
class Table {
 public:
  using value_type = Entry<Key, Value>;

  constexpr Table() = default;
  /// Requires ascending keys.
  template <std::size_t size>
  // NOLINTNEXTLINE(google-explicit-constructor, modernize-avoid-c-arrays)
  consteval Table(const Entry<Key, Value> (&table)[size]) : entries_(table) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  Table(std::map<Key, Value> made) {
    std::vector<Entry<Key, Value>> entries;
    entries.reserve(made.size());
    for (auto& [key, value] : made) entries.push_back({key, std::move(value)});
    entries_ = std::move(entries);
  }
  /// In any order.
  Table(std::initializer_list<Entry<Key, Value>> made) : Table(map_of(made)) {}

  /// To be changed and made a table again.
  [[nodiscard]] std::map<Key, Value> to_map() const {
    std::map<Key, Value> made;
    for (const auto& [key, value] : entries_) made.emplace_hint(made.end(), key, value);
    return made;
  }

  /// Null when there is none.
  [[nodiscard]] const Value* find(const Key& key) const {
    const auto* const found = std::lower_bound(
        begin(), end(), key,
        [](const Entry<Key, Value>& entry, const Key& wanted) { return entry.key < wanted; });
    return found == end() || key < found->key ? nullptr : &found->value;
  }
  /// Throws std::out_of_range when there is none.
  [[nodiscard]] const Value& at(const Key& key) const {
    const Value* found = find(key);
    if (found == nullptr) throw std::out_of_range("Table::at");
    return *found;
  }
  [[nodiscard]] bool contains(const Key& key) const { return find(key) != nullptr; }

  [[nodiscard]] constexpr const Entry<Key, Value>* begin() const { return entries_.begin(); }
  [[nodiscard]] constexpr const Entry<Key, Value>* end() const { return entries_.end(); }
  [[nodiscard]] constexpr std::size_t size() const { return entries_.size(); }
  [[nodiscard]] constexpr bool empty() const { return entries_.empty(); }

 private:
  static std::map<Key, Value> map_of(std::initializer_list<Entry<Key, Value>> entries) {
    std::map<Key, Value> made;
    for (const auto& [key, value] : entries) made.emplace(key, value);
    return made;
  }

  List<Entry<Key, Value>> entries_ = {};
};

}  // namespace spindle::catalogue
