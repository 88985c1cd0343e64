//! Real models, where a copy of them is at hand.

use std::path::{Path, PathBuf};

use pellucid_core::AlphaMode;
use pellucid_scene::load_file;

/// The folder of test scenes; `None` where it was not fetched.
fn scenes_folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os("PELLUCID_SCENES") {
        return Some(folder.into());
    }
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|folder| folder.join("shared/scenes"))
        .find(|folder| folder.is_dir())
}

#[test]
fn real_files_have_the_triangles_their_makers_counted() {
    let files = [
        ("gltf/AlphaBlendModeTest/AlphaBlendModeTest.glb", 61),
        ("gltf/TransmissionTest/TransmissionTest.glb", 128_775),
        ("gltf/GlassVaseFlowers/GlassVaseFlowers.glb", 14_036),
        ("gltf/GlassHurricaneCandleHolder/GlassHurricaneCandleHolder.glb", 4_126),
        ("gltf/GlassBrokenWindow/GlassBrokenWindow.glb", 987),
        ("gltf/StainedGlassLamp/StainedGlassLamp.glb", 35_132),
        ("gltf/BrainStem/BrainStem.glb", 61_666),
        ("gltf/DamagedHelmet/DamagedHelmet.glb", 15_452),
        ("gltf/LittlestTokyo/LittlestTokyo.glb", 141_802),
        ("gltf/2CylinderEngine/2CylinderEngine.glb", 121_496),
        ("gltf/ReciprocatingSaw/ReciprocatingSaw.glb", 198_470),
        ("gltf/GearboxAssy/GearboxAssy.glb", 646_064),
        ("gltf/Buggy/Buggy.glb", 474_329),
        ("gltf/SponzaIvy/SponzaIvy.glb", 15_870),
        ("brain/brain_fsaverage5.glb", 81_920),
        ("oak_tree/oak_tree.glb", 36_006),
        ("crytek_sponza/crytek_sponza.glb", 262_267),
        ("conference_room/conference.glb", 331_179),
        ("sports_car/sports_car.glb", 300_603),
    ];
    let Some(folder) = scenes_folder() else {
        eprintln!("skipped: no test scenes; set PELLUCID_SCENES to their folder");
        return;
    };
    for (file, triangles) in files {
        let path = folder.join(file);
        if !path.exists() {
            eprintln!("skipped: {file} is not there");
            continue;
        }
        let loaded = load_file(&path).unwrap_or_else(|error| panic!("{error}"));
        let scene = &loaded.scene;
        let count = |is: fn(AlphaMode) -> bool| scene.materials().iter().filter(|m| is(m.alpha_mode)).count();
        println!(
            "{file}: {} triangles, {} meshes, {} instances, {} textures, {} cameras; materials: {} opaque, {} mask, {} blend",
            scene.primitive_count(),
            scene.meshes().len(),
            scene.instances().len(),
            scene.textures().len(),
            scene.cameras().len(),
            count(|mode| mode == AlphaMode::Opaque),
            count(|mode| matches!(mode, AlphaMode::Mask { .. })),
            count(|mode| mode == AlphaMode::Blend),
        );
        for warning in &loaded.warnings {
            println!("    {warning}");
        }
        assert_eq!(scene.primitive_count(), triangles, "{file}");
        let sphere = scene.bounding_sphere();
        assert!(sphere.radius.is_finite() && sphere.radius > 0.0, "{file}: {sphere:?}");
    }
}
