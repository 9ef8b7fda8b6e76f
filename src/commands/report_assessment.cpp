#include "report_assessment.hpp"

#include <fmt/format.h>

#include "exact_numbers.hpp"

namespace spindle::commands {
namespace {

constexpr auto index_words = enum_table<Requirement::Index>({{"pp", Requirement::Index::pp},
                                                             {"ppk", Requirement::Index::ppk},
                                                             {"cp", Requirement::Index::cp},
                                                             {"cpk", Requirement::Index::cpk},
                                                             {"yield", Requirement::Index::yield}});

std::optional<double> bound_of(const std::optional<Decimal>& limit) {
  return limit ? std::optional(to_double(*limit)) : std::nullopt;
}

AssessedQuantity assess_quantity(const Stratum& stratum, Quantity quantity,
                                 const work::StudyOptions& study, const ReportOptions& options) {
  AssessedQuantity result{.quantity = quantity,
                          .values = work::values_of(stratum, quantity, study)};
  const work::QuantityLimits& limits = stratum.limits[quantity];
  result.specification = {.lower = bound_of(limits.lower), .upper = bound_of(limits.upper)};
  const statistics::Series series = result.series();
  result.assessment = statistics::assess(
      series, result.specification,
      {.rules = options.rules, .resolution = to_double(stratum.steps[quantity])});
  if (options.machine == MachineStudy::yes) {
    result.machine = statistics::machine_performance(series, result.specification);
  }
  return result;
}

std::optional<double> side_of(const std::optional<statistics::Indices>& indices, RequiredOf of) {
  if (!indices || !indices->index) return std::nullopt;
  return of == RequiredOf::index ? indices->index->value : indices->index->low;
}

/// Pp and Cp have no interval of their own here, so that no lower bound of theirs can be shown.
std::optional<double> centred_of(const std::optional<statistics::Indices>& indices, RequiredOf of) {
  return indices && of == RequiredOf::index ? indices->centred : std::nullopt;
}

Error bad_requirement(const std::string& text, std::string message) {
  Error error{.code = Errc::usage,
              .message = fmt::format("'{}' {}", text, message),
              .hint = "write for example ppk=1.33, angle.cpk=1.67 or yield=99.5%"};
  error.name = "--require";
  return error;
}

Result<Requirement> read_requirement(const std::string& text) {
  Requirement requirement{.text = text};
  std::string_view rest = text;
  const auto equals = rest.find('=');
  if (equals == std::string_view::npos) {
    return tl::unexpected(bad_requirement(text, "does not say how much is required"));
  }
  std::string_view name = rest.substr(0, equals);
  std::string_view least = rest.substr(equals + 1);
  if (const auto dot = name.find('.'); dot != std::string_view::npos) {
    const auto quantity = work::quantity_words.find(name.substr(0, dot));
    if (!quantity) return tl::unexpected(bad_requirement(text, "names no quantity"));
    requirement.quantity = *quantity;
    name.remove_prefix(dot + 1);
  }
  const auto index = index_words.find(name);
  if (!index) {
    return tl::unexpected(
        bad_requirement(text, fmt::format("requires none of {}", index_words.alternatives())));
  }
  requirement.index = *index;
  const bool is_percent = least.ends_with('%');
  if (is_percent) least.remove_suffix(1);
  auto number = Decimal::parse(least);
  if (number && is_percent) number = number->times(Decimal(1, -2));
  const bool is_share = *index == Requirement::Index::yield;
  const bool fits = number && *number >= Decimal(0) && (is_share || !is_percent) &&
                    (!is_share || *number <= Decimal(1));
  if (!fits) {
    return tl::unexpected(bad_requirement(
        text, is_share ? "is no share from 0 to 1, or 0% to 100%" : "is no number"));
  }
  requirement.least = *number;
  return requirement;
}

void judge(const std::vector<Requirement>& requirements, RequiredOf of, Assessed& assessed) {
  for (const AssessedStratum& stratum : assessed.strata) {
    const work::StratumFacts& facts = stratum.stratum->facts;
    const store::Place& place = assessed.study->facts().place(stratum.stratum->place);
    for (const Requirement& requirement : requirements) {
      const auto has = fulfilment_of(requirement, of, stratum);
      if (has && *has >= to_double(requirement.least)) continue;
      const std::string preset =
          facts.preset ? fmt::format(" preset {}", *facts.preset) : std::string();
      const std::string_view bound = of == RequiredOf::lower_bound ? " (lower bound)" : "";
      assessed.unmet.push_back(
          fmt::format("{}{}: {} is not met: {}", place.name, preset, requirement.text,
                      has ? fmt::format("{:.4f}{}", *has, bound) : "it cannot be judged"));
    }
  }
}

}  // namespace

statistics::Series AssessedQuantity::series() const {
  // Integers of a store are finite and never too large.
  return statistics::Series::of(values.values, values.breaks).value();
}

Assessed assess_study(const work::Study& study, const ReportOptions& options) {
  Assessed assessed{.study = &study};
  for (const Stratum* stratum : study.strata()) {
    AssessedStratum result{.stratum = stratum,
                           .yield = statistics::yield_of(stratum->ok, stratum->ng)};
    for (const Quantity quantity : work::quantities) {
      result.quantities[quantity] = assess_quantity(*stratum, quantity, study.options(), options);
    }
    assessed.strata.push_back(std::move(result));
  }
  if (const auto requirements = read_requirements(options.required)) {
    judge(*requirements, options.required_of, assessed);
  }
  return assessed;
}

Result<std::vector<Requirement>> read_requirements(const std::vector<std::string>& texts) {
  std::vector<Requirement> requirements;
  for (const std::string& text : texts) {
    auto requirement = read_requirement(text);
    if (!requirement) return tl::unexpected(std::move(requirement.error()));
    requirements.push_back(std::move(*requirement));
  }
  return requirements;
}

std::optional<double> fulfilment_of(const Requirement& requirement, RequiredOf of,
                                    const AssessedStratum& stratum) {
  const statistics::Assessment& assessment = stratum.quantities[requirement.quantity].assessment;
  switch (requirement.index) {
    case Requirement::Index::pp:
      return centred_of(assessment.performance, of);
    case Requirement::Index::ppk:
      return side_of(assessment.performance, of);
    case Requirement::Index::cp:
      return centred_of(assessment.capability, of);
    case Requirement::Index::cpk:
      return side_of(assessment.capability, of);
    case Requirement::Index::yield:
      break;
  }
  if (!stratum.yield) return std::nullopt;
  return of == RequiredOf::index ? stratum.yield->share : stratum.yield->low;
}

}  // namespace spindle::commands
