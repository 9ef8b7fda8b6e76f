#include "spindle/work/identification.hpp"

#include <algorithm>
#include <utility>

namespace spindle::work {
namespace {

/// What one profile makes of an answer.
struct Match {
  catalogue::Profile profile;
  catalogue::Identity identity;
  catalogue::Generation generation;
  bool named;  ///< by the user, rather than looked for

  /// Of profiles that were not named, one that only extends the product's own is not meant.
  [[nodiscard]] bool fits() const {
    const std::string& product = identity.product_profile;
    return catalogue::judge(profile, identity) == catalogue::Judgement::fits &&
           (named || product.empty() || product == profile.id);
  }
};

Result<std::vector<catalogue::Profile>> profiles_to_match(const std::string& only,
                                                          const Environment& environment) {
  if (only.empty()) return environment.profiles.load_all();
  TRY_LET(auto profile, environment.profiles.load(only));
  std::vector<catalogue::Profile> profiles;
  profiles.push_back(std::move(profile));
  return profiles;
}

Result<std::vector<Match>> matches_of(ByteView answer, const std::string& only,
                                      const Environment& environment) {
  TRY_LET(auto profiles, profiles_to_match(only, environment));
  std::vector<Match> matches;
  for (catalogue::Profile& profile : profiles) {
    if (!profile.identity) continue;
    auto identity = catalogue::decode_identity(*profile.identity, answer);
    const auto generation = catalogue::generation_of(*profile.identity, identity);
    const bool is_earlier = generation == catalogue::Generation::earlier;
    // A firmware that another profile begins with is no fault where nothing was named.
    if (generation == catalogue::Generation::unknown || (is_earlier && only.empty())) continue;
    matches.push_back({std::move(profile), std::move(identity), generation, !only.empty()});
  }
  return matches;
}

Match* best_of(std::vector<Match>& matches) {
  const auto fitting =
      std::find_if(matches.begin(), matches.end(), [](const Match& match) { return match.fits(); });
  if (fitting != matches.end()) return &*fitting;
  return matches.empty() ? nullptr : &matches.front();
}

}  // namespace

Result<Identification> match_identity(ByteView answer, const std::string& only,
                                      const Environment& environment) {
  TRY_LET(auto matches, matches_of(answer, only, environment));
  Identification result;
  for (const Match& match : matches) {
    if (!match.fits()) continue;
    result.candidates.push_back(match.profile.id);
    if (result.candidates.size() > 1) result.series += " or ";
    result.series += match.profile.series;
  }
  if (result.candidates.size() == 1) result.profile = result.candidates.front();
  Match* best = best_of(matches);
  if (best == nullptr) {
    result.identity.raw.assign(answer.begin(), answer.end());
    result.identity.notes.emplace_back("this is not the identity of any known product");
    return result;
  }
  result.generation = best->generation;
  result.maker = best->profile.maker;
  result.identity = best->identity;
  if (result.candidates.empty()) {
    result.identity.notes.push_back(catalogue::misfit(best->profile, best->identity));
  } else {
    result.matched = std::move(best->profile);
  }
  return result;
}

}  // namespace spindle::work
