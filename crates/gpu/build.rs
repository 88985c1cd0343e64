//! Links the shaders: every module under `shaders/technique` and `shaders/pass` becomes one WGSL text.
//!
//! A pass that imports `package::lfb` is written once for all layered fragment buffers; it is linked once with each
//! technique that is one, under the name `PASS_TECHNIQUE`. A technique is one if it defines `fragment_count`.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

use wesl::{CompileOptions, FileResolver, ModulePath, ResolveError, Resolver, Wesl};

/// Takes `package::lfb` for another module.
struct LfbResolver {
    files: FileResolver,
    lfb: Option<ModulePath>,
}

impl LfbResolver {
    fn real<'a>(&'a self, path: &'a ModulePath) -> &'a ModulePath {
        match &self.lfb {
            Some(lfb) if path.components == ["lfb"] => lfb,
            _ => path,
        }
    }
}

impl Resolver for LfbResolver {
    fn resolve_source<'a>(&'a self, path: &ModulePath) -> Result<Cow<'a, str>, ResolveError> {
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
    let techniques = sources("technique");
    let passes = sources("pass");
    let mut linked = BTreeMap::new();
    for stem in techniques.keys() {
        linked.insert(stem.to_uppercase(), link("technique", stem, None));
    }
    for (stem, source) in &passes {
        if !source.contains("package::lfb") {
            linked.insert(stem.to_uppercase(), link("pass", stem, None));
            continue;
        }
        for (technique, technique_source) in &techniques {
            if technique_source.contains("fn fragment_count(") {
                // Random access to the fragments of a pixel, which not every structure has.
                let random_access = technique_source.contains("fn slot_at(");
                let name = format!("{stem}_{technique}").to_uppercase();
                linked.insert(name, link("pass", stem, Some((technique, random_access))));
            }
        }
    }

    let mut constants = String::new();
    for (name, wgsl) in &linked {
        writeln!(constants, "pub(crate) const {name}: &str = r####\"{wgsl}\"####;").expect("strings take all");
    }
    let names: Vec<String> = linked.keys().map(|name| format!("(\"{name}\", {name})")).collect();
    writeln!(constants, "/// All of them, by name.\npub const ALL: [(&str, &str); {}] = [{}];", names.len(), names.join(", "))
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

fn link(folder: &str, stem: &str, lfb: Option<(&String, bool)>) -> String {
    let module = |folder: &str, stem: &str| -> ModulePath {
        format!("package::{folder}::{stem}").parse().expect("stems are identifiers")
    };
    let resolver = LfbResolver {
        files: FileResolver::new("shaders"),
        lfb: lfb.map(|(technique, _)| module("technique", technique)),
    };
    let mut compiler = Wesl::new("shaders").set_custom_resolver(resolver);
    // The one validator that counts is naga's, in the tests.
    compiler.set_options(CompileOptions { validate: false, ..CompileOptions::default() });
    compiler.set_feature("random_access", lfb.is_some_and(|(_, random_access)| random_access));
    match compiler.compile(&module(folder, stem)) {
        Ok(result) => result.to_string(),
        Err(error) => panic!("shaders/{folder}/{stem}.wesl{}: {error}", lfb.map_or(String::new(), |(name, _)| format!(" with {name}"))),
    }
}
