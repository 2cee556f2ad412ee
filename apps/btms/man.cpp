// btms man: the manual page, in the language of man(7). Hidden in --help: packages install what it prints.
#include <spdlog/fmt/fmt.h>

#include "apps/btms/command.h"
#include "apps/btms/command_tree.h"
#include "apps/btms/report.h"

namespace btms {
namespace {

// Text that troff takes as it stands: escapes, and lines that would be requests.
std::string roff(std::string_view text) {
  std::string escaped;
  bool line_starts = true;
  for (const char c : text) {
    if (line_starts && (c == '.' || c == '\'')) escaped += "\\&";
    if (c == '\\')
      escaped += "\\e";
    else if (c == '-')
      escaped += "\\-";
    else if (c == '`')
      escaped += "\\(ga";
    else
      escaped += c;
    line_starts = c == '\n';
  }
  return escaped;
}

std::string option_text(const CLI::Option& option) {
  std::string names;
  for (const std::string& flag : flags_of(option))
    names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ", roff(flag));
  if (names.empty()) names = fmt::format("\\fI{}\\fR", roff(option.get_name(true)));
  if (const std::string placeholder = placeholder_of(option); !placeholder.empty())
    names += fmt::format(" \\fI{}\\fR", roff(placeholder));
  std::string text = fmt::format(".TP\n{}\n{}", names, roff(option.get_description()));
  if (const std::vector<std::string> values = values_of(option); !values.empty())
    text += roff(fmt::format(" ({})", fmt::join(values, ", ")));
  if (!option.get_default_str().empty() && !placeholder_of(option).empty())
    text += roff(fmt::format(" [{}]", option.get_default_str()));
  return text + "\n";
}

std::string options_text(const CLI::App& app) {
  std::string text;
  for (const bool positional : {true, false})
    for (const CLI::Option* option : shown_options(app, positional)) text += option_text(*option);
  return text;
}

std::string as_it_stands(const std::string& text) { return fmt::format(".PP\n.EX\n{}\n.EE\n", roff(text)); }

std::string manual_page(const CLI::App& btms) {
  std::string page = ".\\\" As `btms man` prints it.\n.TH BTMS 1 \"\" \"btms " BTMS_VERSION "\" \"User Commands\"\n";
  page += ".SH NAME\nbtms \\- seamless terrain from city\\-scale point clouds\n";
  page += ".SH SYNOPSIS\n.B btms\n.I SUBCOMMAND\n[\\fIOPTIONS\\fR]\n";
  page += fmt::format(".SH DESCRIPTION\n{}\n{}", roff(btms.get_description()), options_text(btms));
  page += ".SH SUBCOMMANDS\n";
  for (const CLI::App* app : shown_subcommands(btms)) {
    std::string synopsis = fmt::format("btms {} [OPTIONS]", app->get_name());
    for (const CLI::Option* option : shown_options(*app, true)) synopsis += fmt::format(" {}", option->get_name(true));
    page += fmt::format(".SS {}\n{}.\n.PP\n.B {}\n", app->get_name(), roff(app->get_description()), roff(synopsis));
    page += options_text(*app) + as_it_stands(app->get_footer());
  }
  page += fmt::format(".SH EXAMPLES\n{}", as_it_stands(btms.get_footer()));
  page += ".SH SEE ALSO\nThe documents in /usr/share/doc/btms, where the package is installed.";
  return page;
}

}  // namespace

Command add_man(CLI::App& btms) {
  auto common = std::make_shared<CommonOptions>();
  CLI::App* app = btms.add_subcommand("man", "Print the manual page");
  app->group("");
  return {app, common, [&btms] {
            print_line(manual_page(btms));
            return 0;
          }};
}

}  // namespace btms
