#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "description.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/files/tools_file.hpp"
#include "spindle/work/tool_memory.hpp"

namespace spindle::cli {

/// One way to go on with a word.
struct Candidate {
  std::string text;     ///< the whole word; with '=', '.' or ':' at its end more has to follow
  std::string meaning;  ///< one line; may be empty
};

/// Whether the shell's own files belong to the candidates.
enum class Paths : std::uint8_t { none, files, folders };

struct Completion {
  std::vector<Candidate> candidates = {};
  Paths paths = Paths::none;
};

/// What can be named. Nothing is asked over a line: completion works offline.
struct CompletionSources {
  const files::Tools& tools;
  const files::ProfileStore& profiles;
  const work::ToolMemory* memory = nullptr;  ///< may be null
  std::string usual_target = {};             ///< where none is typed; empty: there is none
};

/// What the last of the words, which is still being typed, can become. The program's name is left
/// out. Never fails: what is not understood has no candidates.
Completion complete(const std::vector<std::string>& words, const Description& description,
                    const CompletionSources& nameable);

/// For the shells' scripts: "none", "files" or "folders", then a line "TEXT<tab>MEANING" for each
/// candidate.
std::string to_text(const Completion& completion);

}  // namespace spindle::cli
