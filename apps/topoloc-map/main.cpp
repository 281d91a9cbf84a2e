// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "commands.hpp"
#include "common/run_app.hpp"

int main(int argc, char** argv) {
  CLI::App app("Makes and looks after map files (.tmap).", "topoloc-map");
  app.set_version_flag("--version", TOPOLOC_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  topoloc-map build --drive drive --cloud cloud.laz --trajectory drive/ground_truth.tum \\\n"
      "      --out town.tmap\n"
      "  topoloc-map inspect town.tmap\n"
      "  topoloc-map verify town.tmap\n"
      "  topoloc-map strip town.tmap --out vehicle.tmap\n"
      "  topoloc-map build --help");
  add_build_command(app);
  add_inspect_command(app);
  add_verify_command(app);
  add_strip_command(app);
  return topoloc::apps::run_app(app, "topoloc-map", argc, argv,
                                [] { return topoloc::apps::kDone; });
}
