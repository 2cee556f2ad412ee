// btms completion: what a shell completes. Hidden in --help: packages install what it prints.
#include <spdlog/fmt/fmt.h>

#include "apps/btms/command.h"
#include "apps/btms/command_tree.h"
#include "apps/btms/report.h"

namespace btms {
namespace {

constexpr const char* kHead = R"(# bash completion of btms, as `btms completion bash` prints it
_btms() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]} words values=
  if ((COMP_CWORD == 1)); then
    command=
  fi
)";

// What isn't listed is the name of a file: `complete -o default`.
constexpr const char* kTail = R"(  if [[ -n $values ]]; then
    COMPREPLY=($(compgen -W "$values" -- "$word"))
  elif [[ -z $command || $word == -* ]]; then
    COMPREPLY=($(compgen -W "$words" -- "$word"))
  else
    COMPREPLY=()
  fi
}
complete -o default -F _btms btms btms-mpi)";

std::string bash_completion(const CLI::App& btms) {
  std::string words, values;
  const auto describe = [&](const CLI::App& app, const std::string& name, const std::string& before) {
    std::string list = before;
    for (const CLI::Option* option : shown_options(app, false)) {
      const std::vector<std::string> flags = flags_of(*option);
      for (const std::string& flag : flags) list += (list.empty() ? "" : " ") + flag;
      if (const std::vector<std::string> choices = values_of(*option); !choices.empty())
        for (const std::string& flag : flags)
          values += fmt::format("    '{} {}') values='{}' ;;\n", name, flag, fmt::join(choices, " "));
    }
    words += fmt::format("    '{}') words='{}' ;;\n", name, list);
  };
  std::string names;
  for (const CLI::App* app : shown_subcommands(btms)) names += (names.empty() ? "" : " ") + app->get_name();
  describe(btms, "", names);
  for (const CLI::App* app : shown_subcommands(btms)) describe(*app, app->get_name(), "");
  return kHead +
         fmt::format("  case $command in\n{}  esac\n  case \"$command $before\" in\n{}  esac\n", words, values) + kTail;
}

}  // namespace

Command add_completion(CLI::App& btms) {
  struct CompletionCommand {
    CommonOptions common;
    std::string shell;
  };
  auto command = std::make_shared<CompletionCommand>();
  CLI::App* app = btms.add_subcommand("completion", "Print what completes the command line in a shell");
  app->group("");
  app->add_option("SHELL", command->shell, "bash")->required()->check(CLI::IsMember({"bash"}))->type_name("");
  return {app, {command, &command->common}, [&btms] {
            print_line(bash_completion(btms));
            return 0;
          }};
}

}  // namespace btms
