//! Links the shaders: every module under `shaders/technique` and `shaders/pass`, and the passes under `shaders/fbuffer`,
//! become one WGSL text each.
//!
//! A pass that imports `package::lfb` is written once for all layered fragment buffers; it is linked once with each
//! technique that is one, under the name `PASS_TECHNIQUE`. A technique is one if it defines `fragment_count`.
//!
//! The LFB for other people's shaders, `shaders/lfb`, is linked for each payload: to add fragments, to read them, and with
//! the pass that sorts.

#[path = "build/networks.rs"]
mod networks;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

use wesl::{CompileOptions, FileResolver, ModulePath, ResolveError, Resolver, Wesl};

/// Takes `package::shared::networks` and `part_network` from `build/networks.rs`, and `package::lfb` for another module; and if that is not a technique, what the renderer's own passes know of frame,
/// picture and fragment for that module too.
struct LfbResolver {
    files: FileResolver,
    lfb: Option<ModulePath>,
}

impl LfbResolver {
    fn real<'a>(&'a self, path: &'a ModulePath) -> &'a ModulePath {
        match &self.lfb {
            Some(lfb) if path.components == ["lfb"] => lfb,
            Some(lfb) if lfb.components[0] == "lfb" => match path.components.as_slice() {
                [folder, stem] if folder == "shared" && ["frame", "picture", "fragment"].contains(&stem.as_str()) => {
                    lfb
                }
                _ => path,
            },
            _ => path,
        }
    }
}

impl Resolver for LfbResolver {
    fn resolve_source<'a>(&'a self, path: &ModulePath) -> Result<Cow<'a, str>, ResolveError> {
        if path.components == ["shared", "networks"] {
            return Ok(networks::module().into());
        }
        if path.components == ["shared", "part_network"] {
            return Ok(networks::part_module().into());
        }
        self.files.resolve_source(self.real(path))
    }

    fn display_name(&self, path: &ModulePath) -> Option<String> {
        self.files.display_name(self.real(path))
    }

    fn fs_path(&self, path: &ModulePath) -> Option<PathBuf> {
        self.files.fs_path(self.real(path))
    }
}

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build");
    let techniques = sources("technique");
    let passes = sources("pass");
    let mut linked = BTreeMap::new();
    for stem in techniques.keys() {
        linked.insert(stem.to_uppercase(), link("technique", stem));
    }
    for (stem, source) in &passes {
        if !source.contains("package::lfb") {
            linked.insert(stem.to_uppercase(), link("pass", stem));
            continue;
        }
        for (technique, technique_source) in &techniques {
            // What is sorted is a reference to a fragment, where it cannot be moved itself. Not all have to be sorted.
            let by_reference = technique_source.contains("var fragments: texture_2d_array");
            let can_sort = by_reference || technique_source.contains("fn store(");
            if technique_source.contains("fn fragment_count(") && (stem != "sort" || can_sort) {
                // Random access to the fragments of a pixel, which not every structure has.
                let random_access = technique_source.contains("fn slot_at(");
                let features = [("random_access", random_access), ("by_reference", by_reference), ("sorts", can_sort)];
                let name = format!("{stem}_{technique}").to_uppercase();
                linked.insert(name, compile(&path("pass", stem), Some(path("technique", technique)), &features));
            }
        }
    }
    for stem in ["scatter", "dispatch", "sort", "cover"] {
        let features = [("lists_chunks", stem == "scatter"), ("sorts_parts", stem == "sort")];
        let linked_text = compile(&path("technique::lucid", stem), None, &features);
        linked.insert(format!("LUCID_{}", stem.to_uppercase()), linked_text);
    }
    for stem in ["setup", "bin"] {
        for (suffix, subgroups) in [("", false), ("_SUBGROUPS", true)] {
            let linked_text = compile(
                &path("technique::lucid", stem),
                None,
                &[("subgroups", subgroups), ("sets_up", stem == "setup"), ("tables", true)],
            );
            linked.insert(format!("LUCID_{}{suffix}", stem.to_uppercase()), linked_text);
        }
    }
    // Those that shade know all draws at once.
    for stem in ["raster", "hide"] {
        let features = [("all_draws", true), ("tables", true)];
        let linked_text = compile(&path("technique::lucid", stem), None, &features);
        linked.insert(format!("LUCID_{}", stem.to_uppercase()), linked_text);
    }
    // From there on its fragments are those of a linearized LFB; what the filter left out of order is listed pixel by pixel.
    let lfb = || Some(path("technique", "linear"));
    linked.insert("LUCID_BLEND".to_owned(), compile(&path("technique::lucid", "blend"), lfb(), &[]));
    for (name, stem) in [("LUCID_SORT_WRONG", "sort"), ("LUCID_RESOLVE_WRONG", "resolve")] {
        let features = [("random_access", true), ("by_reference", true), ("sorts", true), ("by_pixel", true)];
        linked.insert(name.to_owned(), compile(&path("pass", stem), lfb(), &features));
    }
    for stem in ["raster", "shade", "collect", "sort", "output", "last"] {
        linked.insert(format!("FBUFFER_{}", stem.to_uppercase()), link("fbuffer", stem));
    }
    for (name, per_pixel) in [("FBUFFER_MODULE", false), ("FRAMEBUFFER_MODULE", true)] {
        linked.insert(name.to_owned(), compile(&path("fbuffer", "module"), None, &[("per_pixel", per_pixel)]));
    }
    for words in 1..=4 {
        for (name, folder, stem, read_only) in [
            ("LFB_CAPTURE", "lfb", "module", false),
            ("LFB_READ", "lfb", "module", true),
            ("LFB_SORT", "lfb", "sort", false),
        ] {
            linked.insert(format!("{name}_{words}"), link_interface(folder, stem, words, read_only));
        }
    }
    linked.insert("LFB_CHECK".to_owned(), link_interface("lfb", "check", 1, false));

    let mut constants = String::new();
    for (name, wgsl) in &linked {
        writeln!(constants, "pub(crate) const {name}: &str = r####\"{wgsl}\"####;").expect("strings take all");
    }
    let names: Vec<String> = linked.keys().map(|name| format!("(\"{name}\", {name})")).collect();
    writeln!(
        constants,
        "/// All of them, by name.\npub const ALL: [(&str, &str); {}] = [{}];",
        names.len(),
        names.join(", ")
    )
    .expect("strings take all");
    let folder = env::var_os("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&folder).join("linked_shaders.rs"), constants).expect("the build folder can be written to");
}

/// The modules of a folder, by stem.
fn sources(folder: &str) -> BTreeMap<String, String> {
    let mut sources = BTreeMap::new();
    for entry in fs::read_dir(Path::new("shaders").join(folder)).expect("the shaders are there") {
        let path = entry.expect("the folder can be read").path();
        if path.extension().is_some_and(|extension| extension == "wesl") {
            let stem = path.file_stem().expect("it has an extension").to_string_lossy().into_owned();
            sources.insert(stem, fs::read_to_string(&path).expect("the shader can be read"));
        }
    }
    sources
}

fn link(folder: &str, stem: &str) -> String {
    compile(&path(folder, stem), None, &[])
}

/// Links with the LFB that has payloads of so many words.
fn link_interface(folder: &str, stem: &str, words: u32, read_only: bool) -> String {
    let payload = |n| (["payload_1", "payload_2", "payload_3", "payload_4"][n as usize - 1], n == words);
    let access = [("random_access", true), ("by_reference", false), ("sorts", true), ("read_only", read_only)];
    let features: Vec<_> = access.into_iter().chain((1..=4).map(payload)).collect();
    compile(&path(folder, stem), Some(path("lfb", "stored")), &features)
}

fn path(folder: &str, stem: &str) -> ModulePath {
    format!("package::{folder}::{stem}").parse().expect("stems are identifiers")
}

fn compile(root: &ModulePath, lfb: Option<ModulePath>, features: &[(&str, bool)]) -> String {
    let with = lfb.as_ref().map_or(String::new(), |lfb| format!(" with {lfb}"));
    let resolver = LfbResolver { files: FileResolver::new("shaders"), lfb };
    let mut compiler = Wesl::new("shaders").set_custom_resolver(resolver);
    // The one validator that counts is naga's, in the tests. The interface for other people's shaders has no entry point.
    let keep_root = ["lfb", "fbuffer"].map(|folder| [folder, "module"]).iter().any(|module| root.components == module);
    compiler.set_options(CompileOptions { validate: false, keep_root, ..CompileOptions::default() });
    for &(feature, is_on) in features {
        compiler.set_feature(feature, is_on);
    }
    match compiler.compile(root) {
        Ok(result) => result.to_string(),
        Err(error) => panic!("{root}{with}: {error}"),
    }
}
