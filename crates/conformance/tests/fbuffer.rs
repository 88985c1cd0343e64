//! The F-Buffer on the CPU: the order of slots, shaders of several passes, overflow, and order-independent blending.

use glam::{Vec4, Vec4Swizzles};
use pellucid::core::fbuffer::order::Geometry;
use pellucid::core::fbuffer::{Overflow, Place, RasterOrder, Size, Windows};
use pellucid::core::oracle;
use pellucid::core::primitive::Pass;
use pellucid::fbuffer::{FBuffer, Output, Program, Target, Verdict, draw_through_framebuffer};
use pellucid::{Scene, View};
use pellucid_conformance::layers::first_difference;
use proptest::prelude::*;

#[path = "common/soup.rs"]
mod soup;

const SCENES: [&str; 4] = ["@cyclic", "@boxes:n=2", "@spheres:n=8,subdivisions=2", "@hairball:strands=20,segments=8"];

fn load(source: &str) -> (Scene, View) {
    let scene = pellucid::load(source).unwrap().scene;
    let view = View::of(&scene).size(71, 53).opacity(0.5);
    (scene, view)
}

fn order<'a>(scene: &'a Scene, view: &View) -> RasterOrder<'a> {
    RasterOrder::new(Geometry::new(scene, view, Pass::Transparent).unwrap())
}

/// From one row of the least buffer to more than anything takes.
fn sizes() -> impl Iterator<Item = Size> {
    let rows = [32, 64, 2048].map(|side| Size::row(side).unwrap());
    rows.into_iter().chain([32, 64, 128, 256].map(|side| Size::square(side).unwrap()))
}

fn one_pass() -> Program<'static, ()> {
    Program::new(|fragment, ()| fragment.color())
}

/// What one pass does in three: the first finds the colour, the second carries it on, the third shows it.
fn three_passes() -> Program<'static, [Vec4; 2]> {
    Program::new(|_, slot: &[Vec4; 2]| Some(slot[1]))
        .pass(|fragment, slot| match fragment.color() {
            Some(color) => {
                slot[0] = color;
                Verdict::Keep
            }
            None => Verdict::Kill,
        })
        .pass(|_, slot| {
            slot[1] = slot[0];
            Verdict::Keep
        })
}

fn blank(view: &View) -> Target {
    Target::new(view.width, view.height, Vec4::new(0.1, 0.2, 0.3, 1.0))
}

fn picture<S: Copy + Default>(order: &RasterOrder<'_>, view: &View, program: &Program<'_, S>, size: Size) -> Target {
    let mut target = blank(view);
    FBuffer::new(size).draw(order, program, Output::default(), &mut target);
    target
}

fn places(order: &RasterOrder<'_>, window: std::ops::Range<u64>) -> Vec<Place> {
    let mut places = Vec::new();
    order.rasterize(window, |place| places.push(place));
    places
}

/// The opaque surfaces, through an F-Buffer too.
fn opaque(scene: &Scene, view: &View) -> Target {
    let mut target = Target::new(view.width, view.height, Vec4::ZERO);
    let order = RasterOrder::new(Geometry::new(scene, view, Pass::Opaque).unwrap());
    FBuffer::new(Size::square(128).unwrap()).draw(&order, &one_pass(), Output::OPAQUE, &mut target);
    target
}

#[test]
fn passes_that_carry_values_change_no_bit_at_any_size() {
    for source in SCENES {
        let (scene, view) = load(source);
        let order = order(&scene, &view);
        let expected = picture(&order, &view, &one_pass(), Size::square(2048).unwrap());
        assert!(expected != blank(&view));
        for size in sizes() {
            assert!(picture(&order, &view, &three_passes(), size) == expected, "{source} in {size}");
        }
    }
}

#[test]
fn through_a_framebuffer_overlapping_surfaces_lose_their_values() {
    for source in SCENES {
        let (scene, view) = load(source);
        let order = order(&scene, &view);
        let expected = picture(&order, &view, &three_passes(), Size::square(64).unwrap());
        let mut target = blank(&view);
        draw_through_framebuffer(&order, &three_passes(), Output::default(), &mut target);
        let mut depth_complexity = vec![0; target.depth.len()];
        for place in places(&order, 0..order.fragments()) {
            depth_complexity[(place.y * view.width + place.x) as usize] += 1;
        }
        let mut wrong = 0;
        for (i, &fragments) in depth_complexity.iter().enumerate() {
            let is_wrong = target.color.pixels()[i] != expected.color.pixels()[i];
            assert!(!is_wrong || fragments > 1, "{source}: pixel {i} has one fragment, and is wrong");
            wrong += usize::from(is_wrong);
        }
        let overlapping = depth_complexity.iter().filter(|&&fragments| fragments > 1).count();
        // Front and back of one thing may have one colour.
        assert!(wrong * 10 > overlapping, "{source}: {wrong} wrong of {overlapping} pixels where surfaces overlap");
    }
}

#[test]
fn kills_masks_and_tests_lead_no_later_pass_astray() {
    let is_killed = |slot: u64| slot.is_multiple_of(3);
    // Any test that a depth passes in every pass or in none.
    let is_seen = |depth: f32| depth.to_bits().is_multiple_of(2);
    let alone =
        Program::new(|fragment, ()| fragment.color().filter(|_| !is_killed(fragment.slot) && is_seen(fragment.depth)));
    // Each pass writes its channel and leaves the others, two of them end fragments, and all check whose slot it is.
    let program = Program::new(|fragment, slot: &(u64, Vec4)| {
        assert_eq!(slot.0, fragment.slot);
        Some(slot.1)
    })
    .pass(move |fragment, slot: &mut (u64, Vec4)| {
        slot.0 = fragment.slot;
        let Some(color) = fragment.color().filter(|_| !is_killed(fragment.slot)) else { return Verdict::Kill };
        slot.1.x = color.x;
        Verdict::Keep
    })
    .pass(move |fragment, slot| {
        assert_eq!(slot.0, fragment.slot);
        slot.1 = fragment.color().unwrap().yzw().extend(0.0).wxyz() + slot.1 * Vec4::X;
        if is_seen(fragment.depth) { Verdict::Keep } else { Verdict::Kill }
    });
    let (scene, view) = load("@spheres:n=8,subdivisions=2");
    let order = order(&scene, &view);
    let expected = picture(&order, &view, &alone, Size::square(2048).unwrap());
    assert!(expected != blank(&view));
    for size in sizes() {
        assert!(picture(&order, &view, &program, size) == expected, "{size}");
    }
}

#[test]
fn windows_take_the_submissions_and_bytes_of_the_formula() {
    let (scene, view) = load("@boxes:n=2");
    let order = order(&scene, &view);
    for size in sizes() {
        let mut fbuffer = FBuffer::<[Vec4; 2]>::new(size);
        let windows = Windows::new(order.fragments(), size);
        let drawn = fbuffer.draw(&order, &three_passes(), Output::default(), &mut blank(&view));
        assert_eq!((drawn.windows, drawn.submissions), (windows.count(), windows.submissions(3)), "{size}");
        assert_eq!(drawn.fragments, order.fragments());
        // Two targets, and whether the fragment was killed.
        assert_eq!(fbuffer.bytes(), size.slots() * 33);
        let (remaining, first) = fbuffer.window(&order, &three_passes(), 0, Output::default(), &mut blank(&view));
        assert_eq!((remaining, first.submissions), (windows.count() - 1, 3));
    }
}

/// Figure 3: 23 windows, 69 passes. Figure 4: 162 overflows and 489 submissions at 64 x 64, 10 and 33 at 256 x 256.
#[test]
fn spheres_take_the_windows_of_the_papers_figures() {
    let fragments = |source: &str, size| {
        let scene = pellucid::load(source).unwrap().scene;
        order(&scene, &View::of(&scene).size(size, size)).fragments()
    };
    let windows = |fragments, side| Windows::new(fragments, Size::square(side).unwrap());
    let figure_3 = fragments("@fbuffer:figure=sphere", 512);
    assert_eq!((windows(figure_3, 128).count(), windows(figure_3, 128).submissions(3)), (23, 69), "{figure_3}");
    for sides in [64, 256] {
        let figure_4 = fragments(&format!("@fbuffer:figure=sphere,sides={sides},fill=0.636"), 1024);
        for (side, overflows, submissions) in [(64, 162, 489), (256, 10, 33)] {
            let windows = windows(figure_4, side);
            assert_eq!((windows.remaining(0), windows.submissions(3)), (overflows, submissions), "{figure_4}");
        }
    }
    // Figure 2: the first 4096 fragments at 64 x 64, a little more at 128 x 128, all of them from 256 x 256 on.
    let rainbow = fragments("@fbuffer:figure=rainbow", 512);
    assert_eq!([64, 128, 256, 512].map(|side| windows(rainbow, side).remaining(0) > 0), [true, true, false, false]);
}

#[test]
fn an_overflow_tells_what_is_needed_and_batches_fit() {
    let (scene, view) = load("@boxes:n=2");
    let order = order(&scene, &view);
    let (small, large) = (Size::square(32).unwrap(), Size::holding(order.fragments()));
    let mut target = blank(&view);
    let overflow = FBuffer::new(small).query(&order, &three_passes(), Output::default(), &mut target).unwrap_err();
    assert_eq!(overflow, Overflow { needed: order.fragments(), slots: 1024 });
    assert!(target == blank(&view), "nothing is drawn");
    let drawn = FBuffer::new(large).query(&order, &three_passes(), Output::default(), &mut target).unwrap();
    assert_eq!((drawn.windows, drawn.submissions), (1, 3));

    let mut batched = blank(&view);
    let drawn = FBuffer::new(small).draw_in_batches(&order, &three_passes(), Output::default(), &mut batched).unwrap();
    assert!(drawn.windows >= order.fragments().div_ceil(small.slots()), "{drawn:?}");
    assert!(batched == target);
    let error = FBuffer::new(Size::row(32).unwrap())
        .draw_in_batches(&order, &three_passes(), Output::default(), &mut batched)
        .unwrap_err();
    assert!(error.needed > 32 && error.slots == 32, "{error}");
}

#[test]
fn a_state_of_ones_own_counts_the_passes_over_its_fragment() {
    #[derive(Debug, Clone, Copy, Default)]
    struct Visits {
        primitive: u32,
        passes: u8,
    }
    let (scene, view) = load("@cyclic");
    let order = order(&scene, &view);
    let visit = |fragment: &pellucid::fbuffer::Fragment<'_>, slot: &mut Visits| {
        assert!(slot.passes == 0 || slot.primitive == fragment.primitive());
        *slot = Visits { primitive: fragment.primitive(), passes: slot.passes + 1 };
        Verdict::Keep
    };
    let program = Program::new(|_, slot: &Visits| {
        assert_eq!(slot.passes, 4);
        Some(Vec4::ONE)
    });
    let program = program.pass(visit).pass(visit).pass(visit).pass(visit);
    let drawn = FBuffer::new(Size::square(32).unwrap()).draw(&order, &program, Output::default(), &mut blank(&view));
    assert_eq!(drawn.submissions, 5 * drawn.windows);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    #[test]
    fn slots_run_by_primitive_row_and_column(scene in soup::soup(), camera in soup::camera(), size in (1u32..60, 1u32..50)) {
        let view = View { camera, ..View::of(&scene).size(size.0, size.1).opacity(0.5) };
        let order = order(&scene, &view);
        let all = places(&order, 0..order.fragments());
        prop_assert!((0..).zip(&all).all(|(slot, place)| place.slot == slot));
        prop_assert!(all.is_sorted_by_key(|place| (place.primitive, place.y, place.x)));
        let geometry = order.geometry();
        prop_assert!(geometry.primitives.is_sorted_by_key(|primitive| geometry.number(primitive)));
        for size in [Size::row(32).unwrap(), Size::square(32).unwrap()] {
            let windows = Windows::new(order.fragments(), size);
            let pieced: Vec<Place> = (0..windows.count()).flat_map(|i| places(&order, windows.slots(i))).collect();
            prop_assert!(pieced == all);
        }
    }

    #[test]
    fn order_independent_blending_equals_the_oracle(scene in soup::soup(), camera in soup::camera(), solid in any::<bool>()) {
        let view = View { camera, ..View::of(&scene).size(41, 33).opacity(if solid { 1.0 } else { 0.6 }) };
        let capture = oracle::capture(&scene, &view).unwrap();
        let order = order(&scene, &view);
        let opaque = opaque(&scene, &view);
        for size in [Size::row(32).unwrap(), Size::square(32).unwrap(), Size::square(256).unwrap()] {
            let (layers, drawn) = FBuffer::new(size).layers(&order, &three_passes(), &opaque).unwrap();
            if let Some(difference) = first_difference(&capture.layers, &layers) {
                return Err(TestCaseError::fail(format!("{size}: {difference}")));
            }
            prop_assert_eq!(drawn.windows, Windows::new(order.fragments(), size).count());
        }
    }
}
