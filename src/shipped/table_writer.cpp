#include "shipped/table_writer.hpp"

#include <cxxabi.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <type_traits>
#include <typeinfo>
#include <variant>

#include "spindle/catalogue/fields.hpp"

namespace spindle::shipped {
namespace {

template <typename T>
std::string type_name() {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> name(
      abi::__cxa_demangle(typeid(T).name(), nullptr, nullptr, &status), &std::free);
  return status == 0 ? std::string(name.get()) : std::string(typeid(T).name());
}

template <typename T>
struct IsList : std::false_type {};
template <typename T>
struct IsList<catalogue::List<T>> : std::true_type {};
template <typename Key, typename Value>
struct IsList<catalogue::Table<Key, Value>> : std::true_type {};

template <typename T>
struct IsOptional : std::false_type {};
template <typename T>
struct IsOptional<std::optional<T>> : std::true_type {};

template <typename T>
struct IsVariant : std::false_type {};
template <typename... T>
struct IsVariant<std::variant<T...>> : std::true_type {};

}  // namespace

std::string TableWriter::quoted(std::string_view text) {
  std::string literal = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\' || c == '?') {
      literal += fmt::format("\\{}", c);
    } else if (c == '\n') {
      literal += "\\n\"\n\"";
    } else if (byte < 0x20 || byte == 0x7F) {
      literal += fmt::format("\\{:03o}", byte);
    } else {
      literal += c;
    }
  }
  return literal + '"';
}

/// An expression of exactly this type.
template <typename T>
std::string TableWriter::expression(const T& value) {
  if constexpr (std::is_same_v<T, catalogue::Text>) {
    return value.empty() ? "Text()" : fmt::format("Text({})", quoted(value));
  } else if constexpr (std::is_same_v<T, Decimal>) {
    return fmt::format("Decimal({}, {})", value.mantissa(), value.exponent());
  } else if constexpr (std::is_same_v<T, Duration>) {
    return fmt::format("Duration({})", value.count());
  } else if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_enum_v<T>) {
    return fmt::format("{}({})", type_name<T>(), static_cast<std::int64_t>(value));
  } else if constexpr (std::is_arithmetic_v<T>) {
    return fmt::format("static_cast<{}>({})", type_name<T>(), static_cast<std::int64_t>(value));
  } else if constexpr (IsOptional<T>::value) {
    return value ? fmt::format("{}({})", type_name<T>(), expression(*value))
                 : fmt::format("{}()", type_name<T>());
  } else if constexpr (IsVariant<T>::value) {
    return std::visit(
        [&](const auto& one) { return fmt::format("{}({})", type_name<T>(), expression(one)); },
        value);
  } else if constexpr (IsList<T>::value) {
    return value.empty()
               ? fmt::format("{}()", type_name<T>())
               : fmt::format("{}({})", type_name<T>(), array_of(value.begin(), value.size()));
  } else {
    std::string members;
    std::apply([&](const auto&... member) { ((members += expression(member) + ", "), ...); },
               catalogue::fields(value));
    return fmt::format("{}{{{}}}", type_name<T>(), members);
  }
}

template <typename T>
std::string TableWriter::array_of(const T* first, std::size_t count) {
  std::string items;
  for (const T* item = first; item != first + count; ++item) {
    items += "    " + expression(*item) + ",\n";
  }
  std::string text = fmt::format("constexpr {} NAME[] = {{\n{}}};\n", type_name<T>(), items);
  const auto [known, is_new] = names_.try_emplace(text, fmt::format("list_{}", names_.size()));
  if (is_new) {
    text.replace(text.find("NAME"), 4, known->second);
    source_ += text;
  }
  return known->second;
}

template <typename T>
std::string TableWriter::constant(const T& value) {
  const std::string text = expression(value);
  const auto [known, is_new] =
      names_.try_emplace(type_name<T>() + text, fmt::format("one_{}", names_.size()));
  if (is_new) {
    source_ += fmt::format("constexpr {} {} = {};\n", type_name<T>(), known->second, text);
  }
  return known->second;
}

std::string TableWriter::add(const catalogue::Profile& profile) { return constant(profile); }
std::string TableWriter::add(const catalogue::SimulationSpec& facts) { return constant(facts); }
std::string TableWriter::add(const catalogue::CodeTables& tables) { return constant(tables); }

}  // namespace spindle::shipped
