use super::messages::{change_settings, posterior};
use super::*;
use crate::supports::{SupportsError, test_supports};

/// The supports' header and messages as they are sent.
pub(super) fn supports() -> (SupportsHeader, Vec<SupportMessage>) {
    let learned = test_supports::some();
    let mut header = SupportsHeader::default();
    header.write(&learned);
    let message = |support| {
        let mut message = SupportMessage::default();
        message.write(support);
        message
    };
    (header, learned.supports().iter().map(message).collect())
}

#[test]
fn supports_survive_the_way() {
    let (header, messages) = supports();
    let (sent, arrived) = (test_supports::some(), header.check(&messages).expect("good supports"));
    assert_eq!((arrived.table(), arrived.digest()), (sent.table(), sent.digest()));
    assert_eq!((arrived.origin_m(), arrived.spacing_m()), (sent.origin_m(), sent.spacing_m()));
    assert!(arrived.learned_with().is_none() && sent.learned_with().is_some(), "it does not travel");
}

#[test]
fn every_damage_to_supports_is_named() {
    use SupportsError as Bad;
    use SupportsRejected as No;
    type Damage = (fn(&mut SupportsHeader, &mut [SupportMessage]), fn(&SupportsRejected) -> bool);
    let damages: [Damage; 18] = [
        (|h, _| h.magic ^= 1, |e| matches!(e, No::Layout(LayoutError::Magic { .. }))),
        (|h, _| h.version = 1, |e| matches!(e, No::Layout(LayoutError::Version { found: 1, .. }))),
        (|h, _| h.count += 1, |e| matches!(e, No::Count { .. })),
        (|h, _| h.count = u64::MAX, |e| matches!(e, No::Count { .. })),
        (|h, _| h.digest ^= 1, |e| matches!(e, No::Digest { .. })),
        (|h, _| h.digest = 0, |e| matches!(e, No::Digest { claimed: 0, .. })),
        (|h, _| h.origin_m[1] = f32::NAN, |e| matches!(e, No::Supports(Bad::Value { name: "origin", .. }))),
        (|h, _| h.origin_m[1] = 1.0, |e| matches!(e, No::Digest { .. })),
        (|h, _| h.spacing_m = 0.0, |e| matches!(e, No::Supports(Bad::Value { name: "spacing", .. }))),
        (|h, _| h.first = [i32::MIN; 2], |e| matches!(e, No::Supports(Bad::Table(_)))),
        (|h, _| h.width = [u32::MAX; 2], |e| matches!(e, No::Supports(Bad::Table(_)))),
        (|h, _| h.width = [0, 0], |e| matches!(e, No::Supports(Bad::Table(_)))),
        (|h, _| h.width = [4, 3], |e| matches!(e, No::Digest { .. })),
        (|h, _| h.kinds[1] = [0xff; 32], |e| matches!(e, No::Supports(Bad::Kind { node: [-1, 3], kind: 1 }))),
        (|_, s| s[2].kind = 99, |e| matches!(e, No::Supports(Bad::Kind { node: [-1, 4], kind: 99 }))),
        (|_, s| s[2].kind = 3, |e| matches!(e, No::Supports(Bad::Kind { kind: 3, .. }))),
        (|_, s| s[4].numbers[0] = f32::NAN, |e| matches!(e, No::Supports(Bad::Numbers { node: [0, 2], .. }))),
        (|_, s| s.swap(1, 4), |e| matches!(e, No::Digest { .. })),
    ];
    for (number, (damage, expected)) in damages.into_iter().enumerate() {
        let (mut header, mut messages) = supports();
        damage(&mut header, &mut messages);
        let error = header.check(&messages).expect_err("damaged");
        assert!(expected(&error), "damage {number} gives {error:?}");
    }
    let (header, messages) = supports();
    assert!(matches!(header.check(&messages[1..]), Err(No::Count { claimed: 12, arrived: 11 })));
}

#[test]
fn a_posterior_is_used_with_its_own_supports_only() {
    let (mut header, tiles) = posterior();
    let learned = test_supports::some();
    let missing = PosteriorRejected::SupportsMissing { digest: learned.digest() };
    header.supports_digest = learned.digest();
    assert_eq!(header.check(&tiles, None), Err(missing));
    assert_eq!(header.check(&tiles, Some(&test_supports::over_a_building(0.5))), Err(missing));
    let model = header.check(&tiles, Some(&learned)).expect("its supports");
    assert_eq!(&model.model.basis.supports.table, learned.table());
    // Supports that are there and not meant have no say.
    header.supports_digest = 0;
    assert!(header.check(&tiles, Some(&learned)).expect("no supports").model.basis.supports.table.is_empty());
    header.supports_digest = learned.digest();
    change_settings(&mut header, |settings| settings.spacing_m = 0.25);
    let elsewhere = SupportsError::Spacing { learned_m: 0.5, map_m: 0.25 };
    assert_eq!(header.check(&tiles, Some(&learned)), Err(SupportsRejected::Supports(elsewhere).into()));
}
