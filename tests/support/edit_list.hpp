#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/catalogue/list.hpp"

namespace spindle::test {

/// Puts a list with one item more in the place of a list, which is never changed itself.
template <typename T>
void append(catalogue::List<T>& list, std::type_identity_t<T> item) {
  std::vector<T> items(list.begin(), list.end());
  items.push_back(std::move(item));
  list = std::move(items);
}

/// The same with one item changed by `change(item)`.
template <typename T, typename Change>
void edit(catalogue::List<T>& list, std::size_t at, const Change& change) {
  std::vector<T> items(list.begin(), list.end());
  change(items.at(at));
  list = std::move(items);
}

}  // namespace spindle::test
