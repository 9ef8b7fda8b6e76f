#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/enum_table.hpp"
#include "spindle/base/error.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::cli {

/// The error of a command line that cannot be understood.
Error usage(std::string message, std::string hint = {});
/// The same with the advice to read the help of the command.
Error for_help(std::string_view path, Error error);
/// The error of an option whose value is not what it takes.
Error bad_option(std::string_view option, std::string message, std::string hint);

// ---- converters: Result<Value>(option, text); the error says what the option takes ----

/// A number from `minimum` to `maximum`.
struct NumberFrom {
  std::uint64_t minimum;
  std::uint64_t maximum;
  Result<std::uint64_t> operator()(std::string_view option, const std::string& text) const;
};

/// "500ms", "2.5s", "5min"; more than no time at all.
Result<Duration> to_duration(std::string_view option, const std::string& text);

/// "1-3,7": units of a serial line, each once, in the order given.
Result<std::vector<modbus::UnitId>> to_units(std::string_view option, const std::string& text);

/// "name,value,unit": words between commas.
Result<std::vector<std::string>> to_columns(std::string_view option, const std::string& text);

/// "0..999", "0x0..0x3E7" or one register; both ends count.
struct RegisterBounds {
  std::uint16_t from = 0;
  std::uint16_t to = 0;
};
Result<RegisterBounds> to_registers(std::string_view option, const std::string& text);

/// How an error tells of a word that an option does not take.
Error unknown_choice(std::string_view option, const std::string& text,
                     const std::vector<std::string>& words);

/// One of the words of a table, with a suggestion for a misspelt one.
template <typename E, std::size_t count>
auto one_of(const EnumTable<E, count>& table) {
  return [&table](std::string_view option, const std::string& text) -> Result<E> {
    const auto meant = table.find(text);
    if (!meant) return tl::unexpected(unknown_choice(option, text, table.words()));
    return *meant;
  };
}

/// What is wrong with the options of a command, found while they are parsed.
struct Faults {
  /// A check over several options, made when all were read; empty where all is well. It may move
  /// what was typed to where it belongs.
  using Check = std::function<std::optional<Error>()>;

  std::vector<Check> required = {};  ///< arguments that must be there
  std::optional<Error> conversion = std::nullopt;
  std::vector<Check> checks = {};

  /// What is told of: a missing argument before a wrong value before a wrong combination.
  [[nodiscard]] std::optional<Error> first() const;
};

/// Declares what can stand behind a command, an option a line: its name, where its value goes and
/// how it is converted. The parser writes there while it parses, so the targets must live as long
/// as it does.
class Binder {
 public:
  /// `path` is the command's name for errors: "profile show".
  Binder(CLI::App& app, std::string path, Faults& faults)
      : app_(&app), path_(std::move(path)), faults_(&faults) {}

  /// An argument, or all that follow where `into` is a list.
  template <typename Into>
  void argument(const std::string& name, Into& into, std::string_view meaning) {
    CLI::Option* added = app_->add_option(name, into, std::string(meaning));
    if constexpr (!std::is_same_v<Into, std::string>) take_as_typed(added);
  }

  /// The same, without which the command makes no sense.
  template <typename Into>
  void required(const std::string& name, Into& into, std::string_view meaning) {
    argument(name, into, meaning);
    faults_->required.push_back([path = path_, name, &into]() -> std::optional<Error> {
      if (!into.empty()) return std::nullopt;
      return missing(path, name);
    });
  }

  /// An option as typed; of several the last one counts.
  CLI::Option* option(const std::string& names, const std::string& placeholder, std::string& into,
                      std::string_view meaning) {
    return named(app_->add_option(names, into, std::string(meaning)), placeholder);
  }

  /// An option whose text becomes a value, in an optional or not.
  template <typename Into, typename Convert>
  CLI::Option* option(const std::string& names, const std::string& placeholder, Into& into,
                      Convert convert, std::string_view meaning) {
    const auto read = [faults = faults_, name = long_name(names), &into,
                       convert](const std::string& text) {
      auto value = convert(name, text);
      if (value) {
        assign(into, std::move(*value));
      } else if (!faults->conversion) {
        faults->conversion = std::move(value.error());
      }
    };
    return named(app_->add_option_function<std::string>(names, read, std::string(meaning)),
                 placeholder);
  }

  /// An option that may be given several times.
  CLI::Option* repeatable(const std::string& names, const std::string& placeholder,
                          std::vector<std::string>& into, std::string_view meaning) {
    return app_->add_option(names, into, std::string(meaning))
        ->type_name(placeholder)
        ->expected(1)
        ->allow_extra_args(false)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  }

  CLI::Option* flag(const std::string& names, std::function<void()> set, std::string_view meaning) {
    return app_->add_flag_callback(names, std::move(set), std::string(meaning))
        ->disable_flag_override();
  }

  /// A flag that makes `into` this value.
  template <typename Into>
  CLI::Option* flag(const std::string& names, Into& into, Into value, std::string_view meaning) {
    return flag(
        names, [&into, value] { into = value; }, meaning);
  }

  /// Looks at several options together.
  void check(Faults::Check check) { faults_->checks.push_back(std::move(check)); }

  /// The parser's command, for commands below it.
  [[nodiscard]] CLI::App& command() const { return *app_; }

  static Error missing(std::string_view path, std::string_view argument);

 private:
  /// CLI11 takes what follows for more words of a list where it "allows extra arguments", and then
  /// also [a,b] for two of them. That many words are never there, so it goes on taking them.
  static void take_as_typed(CLI::Option* list) {
    list->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->expected(CLI::detail::expected_max_vector_size - 1)
        ->allow_extra_args(false);
  }

  static CLI::Option* named(CLI::Option* option, const std::string& placeholder) {
    return option->type_name(placeholder)->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  }

  /// "--count" of "-c,--count".
  static std::string long_name(const std::string& names) {
    return names.substr(names.rfind(',') + 1);
  }

  template <typename Into, typename Value>
  static void assign(Into& into, Value&& value) {
    into = static_cast<Into>(std::forward<Value>(value));
  }
  template <typename Into, typename Value>
  static void assign(std::optional<Into>& into, Value&& value) {
    into = static_cast<Into>(std::forward<Value>(value));
  }

  CLI::App* app_;
  std::string path_;
  Faults* faults_;
};

}  // namespace spindle::cli
