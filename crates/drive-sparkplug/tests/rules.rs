//! The specification's numbered assertions, each by its id, on everything that an edge node sends in a long day.

#![expect(non_snake_case, reason = "the names are the specification's ids")]

#[expect(dead_code, reason = "some of it is for the other tests")]
mod support;

use std::{
    collections::BTreeSet,
    sync::{Arc, OnceLock},
    time::Duration,
};

use drive_sparkplug::{Event, Id, Ignored, Quality, Settings, Value};
use support::{Rig, recording::Recording, rules, settings};

/// Births, data, more messages than there are numbers, a trip, a loss and a return, a rebirth, a broken connection, and an
/// orderly end.
fn a_long_day() -> Rig {
    let mut rig = Rig::new(settings());
    rig.run("pump 1", 0.0);
    rig.run("fan 1", 20.0);
    rig.connect();
    for step in 0..300_u32 {
        rig.wait(Duration::from_millis(500));
        rig.run("pump 1", f64::from(step) / 10.0);
        rig.set("pump 1", "Counts", Some(Value::Int32(-1 - step as i32)), Quality::Good);
        rig.set("pump 1", "Status/State", Some(Value::String("running".to_owned())), Quality::Good);
        rig.set_errors(u64::from(step));
    }
    rig.set("fan 1", "Status/State", Some(Value::String("fault".to_owned())), Quality::Good);
    rig.set("fan 1", "Status/Output Frequency", Some(Value::Double(20.0)), Quality::Stale);
    rig.set("fan 1", "Counts", None, Quality::Bad);
    rig.node.set_present("fan 1", false);
    rig.wait(Duration::from_secs(1));
    rig.set("fan 1", "Status/Output Frequency", Some(Value::Double(0.0)), Quality::Good);
    rig.run("fan 1", 0.0);
    rig.ask_for_rebirth();
    rig.wait(Duration::from_secs(10));
    rig.set_errors(1_000);
    rig.lose();
    rig.wait(Duration::from_secs(1));
    rig.connect();
    rig.run("pump 1", 50.0);
    rig.leave();
    rig.connect();
    rig.set_errors(2_000);
    rig.leave();
    rig
}

fn recorded() -> &'static Arc<Recording> {
    static RECORDING: OnceLock<Arc<Recording>> = OnceLock::new();
    RECORDING.get_or_init(|| Arc::new(a_long_day().recording()))
}

macro_rules! rules {
    ($($id:ident)*) => {
        $(
            #[test]
            fn $id() {
                let cases = rules::judge(stringify!($id), recorded());
                assert!(matches!(cases, Ok(1..)), "{cases:?}");
            }
        )*

        #[test]
        fn every_rule_that_is_known_is_asserted() {
            assert_eq!(BTreeSet::from([$(stringify!($id).to_owned()),*]), rules::ids());
        }
    };
}

rules! {
    tck_id_principles_persistence_clean_session_50
    tck_id_payloads_ndeath_will_message
    tck_id_message_flow_edge_node_birth_publish_will_message
    tck_id_message_flow_edge_node_birth_publish_will_message_topic
    tck_id_payloads_ndeath_will_message_qos
    tck_id_message_flow_edge_node_birth_publish_will_message_qos
    tck_id_payloads_ndeath_will_message_retain
    tck_id_message_flow_edge_node_birth_publish_will_message_will_retained
    tck_id_message_flow_edge_node_birth_publish_will_message_payload
    tck_id_topics_nbirth_bdseq_increment
    tck_id_message_flow_edge_node_birth_publish_will_message_payload_bdSeq
    tck_id_message_flow_edge_node_ncmd_subscribe
    tck_id_message_flow_device_dcmd_subscribe
    tck_id_principles_birth_certificates_order
    tck_id_message_flow_edge_node_birth_publish_connect
    tck_id_topic_structure
    tck_id_topic_structure_namespace_a
    tck_id_topic_structure_namespace_device_id_associated_message_types
    tck_id_topic_structure_namespace_device_id_non_associated_message_types
    tck_id_topic_structure_namespace_valid_group_id
    tck_id_topic_structure_namespace_valid_edge_node_id
    tck_id_topic_structure_namespace_valid_device_id
    tck_id_topics_nbirth_topic
    tck_id_message_flow_edge_node_birth_publish_nbirth_topic
    tck_id_topics_ndata_topic
    tck_id_topics_ndeath_topic
    tck_id_topics_dbirth_topic
    tck_id_message_flow_device_birth_publish_dbirth_topic
    tck_id_topics_ddata_topic
    tck_id_topics_ddeath_topic
    tck_id_message_flow_device_birth_publish_dbirth_match_edge_node_topic
    tck_id_case_sensitivity_sparkplug_ids
    tck_id_case_sensitivity_metric_names
    tck_id_topics_nbirth_mqtt
    tck_id_payloads_nbirth_qos
    tck_id_payloads_nbirth_retain
    tck_id_message_flow_edge_node_birth_publish_nbirth_qos
    tck_id_message_flow_edge_node_birth_publish_nbirth_retained
    tck_id_topics_dbirth_mqtt
    tck_id_payloads_dbirth_qos
    tck_id_payloads_dbirth_retain
    tck_id_message_flow_device_birth_publish_dbirth_qos
    tck_id_message_flow_device_birth_publish_dbirth_retained
    tck_id_topics_ndata_mqtt
    tck_id_payloads_ndata_qos
    tck_id_payloads_ndata_retain
    tck_id_topics_ddata_mqtt
    tck_id_payloads_ddata_qos
    tck_id_payloads_ddata_retain
    tck_id_topics_ddeath_mqtt
    tck_id_topics_nbirth_timestamp
    tck_id_payloads_nbirth_timestamp
    tck_id_topics_dbirth_timestamp
    tck_id_payloads_dbirth_timestamp
    tck_id_topics_ndata_timestamp
    tck_id_payloads_ndata_timestamp
    tck_id_topics_ddata_timestamp
    tck_id_payloads_ddata_timestamp
    tck_id_payloads_ddeath_timestamp
    tck_id_payloads_timestamp_in_UTC
    tck_id_payloads_metric_timestamp_in_UTC
    tck_id_topics_nbirth_seq_num
    tck_id_payloads_nbirth_seq
    tck_id_payloads_sequence_num_req_nbirth
    tck_id_message_flow_edge_node_birth_publish_nbirth_payload_seq
    tck_id_payloads_sequence_num_always_included
    tck_id_payloads_sequence_num_incrementing
    tck_id_topics_dbirth_seq
    tck_id_payloads_dbirth_seq
    tck_id_payloads_dbirth_seq_inc
    tck_id_message_flow_device_birth_publish_dbirth_payload_seq
    tck_id_topics_ndata_seq_num
    tck_id_payloads_ndata_seq
    tck_id_payloads_ndata_seq_inc
    tck_id_topics_ddata_seq_num
    tck_id_payloads_ddata_seq
    tck_id_payloads_ddata_seq_inc
    tck_id_topics_ddeath_seq_num
    tck_id_payloads_ddeath_seq
    tck_id_payloads_ddeath_seq_inc
    tck_id_payloads_ddeath_seq_number
    tck_id_topics_ndeath_seq
    tck_id_payloads_ndeath_seq
    tck_id_topics_ndeath_payload
    tck_id_message_flow_edge_node_birth_publish_nbirth_payload
    tck_id_message_flow_device_birth_publish_dbirth_payload
    tck_id_topics_nbirth_metrics
    tck_id_operational_behavior_data_publish_nbirth_values
    tck_id_topics_dbirth_metrics
    tck_id_operational_behavior_data_publish_dbirth_values
    tck_id_payloads_metric_datatype_req
    tck_id_payloads_metric_datatype_value
    tck_id_payloads_metric_datatype_value_type
    tck_id_payloads_metric_datatype_not_req
    tck_id_topics_nbirth_bdseq_included
    tck_id_payloads_nbirth_bdseq
    tck_id_topics_nbirth_bdseq_matching
    tck_id_payloads_nbirth_bdseq_repeat
    tck_id_operational_behavior_data_commands_rebirth_action_3
    tck_id_message_flow_edge_node_birth_publish_nbirth_payload_bdSeq
    tck_id_payloads_ndeath_bdseq
    tck_id_topics_nbirth_rebirth_metric
    tck_id_payloads_nbirth_rebirth_req
    tck_id_operational_behavior_data_commands_rebirth_name
    tck_id_operational_behavior_data_commands_rebirth_datatype
    tck_id_operational_behavior_data_commands_rebirth_value
    tck_id_operational_behavior_data_commands_rebirth_name_aliases
    tck_id_topics_nbirth_metric_reqs
    tck_id_operational_behavior_data_publish_nbirth
    tck_id_topics_dbirth_metric_reqs
    tck_id_operational_behavior_data_publish_dbirth
    tck_id_operational_behavior_data_publish_nbirth_order
    tck_id_operational_behavior_data_publish_dbirth_order
    tck_id_message_flow_device_birth_publish_nbirth_wait
    tck_id_payloads_dbirth_order
    tck_id_payloads_ndata_order
    tck_id_payloads_ddata_order
    tck_id_operational_behavior_device_ddeath
    tck_id_operational_behavior_edge_node_intentional_disconnect_ndeath
    tck_id_payloads_ndeath_will_message_publisher
    tck_id_operational_behavior_edge_node_intentional_disconnect_packet
    tck_id_payloads_ndeath_will_message_publisher_disconnect_mqtt50
    tck_id_operational_behavior_data_commands_rebirth_action_1
    tck_id_operational_behavior_data_commands_rebirth_action_2
    tck_id_topics_ndata_payload
    tck_id_operational_behavior_data_publish_nbirth_change
    tck_id_topics_ddata_payload
    tck_id_operational_behavior_data_publish_dbirth_change
    tck_id_payloads_name_birth_data_requirement
    tck_id_payloads_name_requirement
    tck_id_payloads_alias_birth_requirement
    tck_id_payloads_alias_data_cmd_requirement
    tck_id_payloads_alias_uniqueness
    tck_id_payloads_propertyset_keys_array_size
    tck_id_payloads_propertyset_values_array_size
    tck_id_payloads_propertyset_quality_value_type
    tck_id_payloads_metric_propertyvalue_type_type
    tck_id_payloads_metric_propertyvalue_type_value
    tck_id_payloads_metric_propertyvalue_type_req
    tck_id_payloads_propertyset_quality_value_value
}

fn with_a_host() -> Rig {
    let mut rig = Rig::new(Settings { primary_host: Some(Id::new("scada").unwrap()), ..settings() });
    rig.run("pump 1", 10.0);
    rig
}

fn with_other_servers() -> Rig {
    let settings = Settings { primary_host: Some(Id::new("scada").unwrap()), ..settings() };
    let mut rig = Rig::new(Settings { has_other_servers: true, ..settings });
    rig.run("pump 1", 10.0);
    rig
}

#[test]
fn tck_id_message_flow_edge_node_birth_publish_phid_wait() {
    let mut rig = with_a_host();
    rig.connect();
    rig.run("pump 1", 20.0);
    assert!(rig.topics(0).is_empty());
    rig.state(true, 1_000);
    assert_eq!(rig.topics(0), ["NBIRTH", "DBIRTH pump 1"]);
}

#[test]
fn tck_id_operational_behavior_edge_node_birth_sequence_wait() {
    let mut rig = with_a_host();
    rig.connect();
    rig.ask_for_rebirth();
    rig.wait(Duration::from_secs(60));
    assert!(rig.topics(0).is_empty(), "a request for births does not replace the host");
    rig.state(true, 1);
    assert_eq!(rig.topics(0), ["NBIRTH", "DBIRTH pump 1"]);
}

#[test]
fn tck_id_message_flow_edge_node_birth_publish_phid_wait_id() {
    let mut rig = with_a_host();
    rig.connect();
    let event = rig.hear("spBv1.0/STATE/scada 2", br#"{"online":true,"timestamp":1000}"#, true);
    assert_eq!(event, Some(Event::Ignored(Ignored::NotOurs("spBv1.0/STATE/scada 2".to_owned()))));
    assert!(rig.topics(0).is_empty());
}

#[test]
fn tck_id_message_flow_edge_node_birth_publish_phid_wait_online() {
    let mut rig = with_a_host();
    rig.connect();
    rig.state(false, 1_000);
    assert!(rig.topics(0).is_empty());
    for wrong in
        [&b"ONLINE"[..], b"{}", br#"{"online":"true","timestamp":1}"#, br#"{"online":true}"#, b"\xff", b""]
    {
        assert!(matches!(
            rig.hear("spBv1.0/STATE/scada", wrong, true),
            Some(Event::Ignored(Ignored::NotAState(_)))
        ));
    }
    assert!(rig.topics(0).is_empty());
}

#[test]
fn tck_id_message_flow_edge_node_birth_publish_phid_wait_timestamp() {
    let mut rig = with_a_host();
    rig.connect();
    rig.state(false, 1_000);
    rig.state(true, 999);
    assert!(rig.topics(0).is_empty(), "it was online before it went");
    rig.state(true, 1_000);
    assert_eq!(rig.topics(0), ["NBIRTH", "DBIRTH pump 1"]);
}

#[test]
fn tck_id_message_flow_edge_node_birth_publish_phid_offline() {
    let mut rig = with_a_host();
    rig.connect();
    rig.state(true, 1_000);
    let mark = rig.mark();
    rig.state(false, 1_000);
    assert_eq!(rig.topics(mark), ["NDEATH"]);
    assert_eq!(rig.reconnect, Some(true));
    // It begins again, and waits again.
    rig.connect();
    let mark = rig.mark();
    rig.state(false, 1_000);
    assert!(rig.topics(mark).is_empty());
    rig.state(true, 2_000);
    assert_eq!(rig.topics(mark), ["NBIRTH", "DBIRTH pump 1"]);
}

#[test]
fn tck_id_operational_behavior_edge_node_termination_host_offline() {
    let mut rig = with_a_host();
    rig.connect();
    rig.state(true, 1_000);
    rig.state(false, 2_000);
    assert!(!rig.node.is_alive());
    assert_eq!(rig.reconnect, Some(true));
}

#[test]
fn tck_id_operational_behavior_edge_node_termination_host_offline_reconnect() {
    let mut rig = with_other_servers();
    rig.connect();
    rig.state(true, 1_000);
    rig.state(false, 2_000);
    assert_eq!(rig.reconnect, Some(true));
    // The next server has times of its own.
    rig.connect();
    rig.state(true, 500);
    assert!(rig.node.is_alive());
}

#[test]
fn tck_id_operational_behavior_edge_node_termination_host_offline_timestamp() {
    let mut rig = with_a_host();
    rig.connect();
    rig.state(true, 1_000);
    let mark = rig.mark();
    rig.state(false, 999);
    assert!(rig.topics(mark).is_empty());
    assert!(rig.node.is_alive());
    assert_eq!(rig.reconnect, None);
}

#[test]
fn tck_id_operational_behavior_primary_application_state_with_multiple_servers_walk() {
    let mut rig = with_other_servers();
    rig.connect();
    rig.state(false, 1_000);
    assert_eq!(rig.topics(0), ["NDEATH"]);
    assert_eq!(rig.reconnect, Some(true));
}

#[test]
fn tck_id_operational_behavior_primary_application_state_with_multiple_servers_state_subs() {
    let mut rig = with_other_servers();
    rig.connect();
    let is_it = |packet: &support::recording::Packet| matches!(packet, support::recording::Packet::Subscribe { filter, qos: 1 } if filter == "spBv1.0/STATE/scada");
    assert!(rig.packets.iter().any(is_it));
}

#[test]
fn tck_id_topic_structure_namespace_unique_device_id() {
    let mut rig = Rig::new(settings());
    assert!(rig.node.add_device("PUMP 1", support::definitions(), rig.now).is_err());
}

#[test]
fn tck_id_operational_behavior_data_commands_ncmd_rebirth_value() {
    let mut rig = Rig::new(settings());
    rig.connect();
    rig.wait(Duration::from_secs(60));
    let mark = rig.mark();
    let payload = support::written(rig.now, "Node Control/Rebirth", drive_sparkplug::Raw::Boolean(false));
    assert_eq!(rig.hear("spBv1.0/plant/NCMD/hall 1", &payload, false), None);
    assert!(rig.topics(mark).is_empty());
}
