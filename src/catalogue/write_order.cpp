#include "spindle/catalogue/write_order.hpp"

#include <algorithm>

#include "spindle/base/text.hpp"

namespace spindle::catalogue {
namespace {

bool names(const List<Text>& patterns, const Parameter& parameter) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const Text& pattern) {
    return pattern == parameter.name.view() || glob_match(pattern, parameter.name);
  });
}

bool waits_for(const Parameter& one, const Parameter& other) {
  const bool is_scaled_by = !one.scale_by.empty() && other.name == one.scale_by.view();
  return is_scaled_by || names(one.after, other) || names(other.before, one);
}

/// Whether any of them says when it is written.
bool have_order(const std::vector<Parameter>& parameters) {
  return std::any_of(parameters.begin(), parameters.end(), [](const Parameter& parameter) {
    return !parameter.before.empty() || !parameter.after.empty() || !parameter.scale_by.empty();
  });
}

/// What is left when all that can be written in order are taken out, one by one.
struct Ordered {
  std::vector<std::size_t> order;
  std::vector<std::size_t> circle;
};

Ordered ordered(const std::vector<Parameter>& parameters) {
  std::vector<std::size_t> left(parameters.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
  Ordered result;
  if (!have_order(parameters)) return {std::move(left), {}};
  while (!left.empty()) {
    const auto next = std::find_if(left.begin(), left.end(), [&](std::size_t one) {
      return std::none_of(left.begin(), left.end(), [&](std::size_t other) {
        return other != one && waits_for(parameters[one], parameters[other]);
      });
    });
    if (next == left.end()) break;
    result.order.push_back(*next);
    left.erase(next);
  }
  result.circle = std::move(left);
  return result;
}

}  // namespace

std::vector<std::size_t> write_order(const std::vector<Parameter>& parameters) {
  auto [order, circle] = ordered(parameters);
  order.insert(order.end(), circle.begin(), circle.end());
  return order;
}

std::vector<std::string> waiting_in_a_circle(const std::vector<Parameter>& parameters) {
  std::vector<std::string> circle;
  for (const std::size_t index : ordered(parameters).circle) {
    circle.push_back(parameters[index].name);
  }
  return circle;
}

}  // namespace spindle::catalogue
